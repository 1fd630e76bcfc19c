"""Prediction of the accuracy that planned passes will give, and advice on further passes."""
