"""When does exploration pay? Closed-form scenes with a knob for each cause, and their map."""
