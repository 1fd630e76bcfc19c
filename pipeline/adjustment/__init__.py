"""Stage adjust: from labelled points through the observation model and its iteration to tables."""
