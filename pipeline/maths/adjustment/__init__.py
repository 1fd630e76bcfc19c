"""The rigorous least-squares adjustment: observations, normal equations, solution, tests of residuals."""
