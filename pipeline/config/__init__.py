"""Settings: the YAML files of pool, session, target, plan and marks as strict models."""
