"""The two sequential methods of patent CN 105425246 B: angles, then offsets."""
