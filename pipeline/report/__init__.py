"""The report on a calibration: verdict, warnings, suspected causes, calibration.json."""
