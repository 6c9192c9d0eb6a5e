"""Wind: from force, from accelerometers, by disturbance observers."""
