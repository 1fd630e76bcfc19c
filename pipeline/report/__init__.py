"""The answer: verdict, warnings, suspected causes, calibration.json."""
