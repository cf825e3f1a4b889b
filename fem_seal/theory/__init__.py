"""What can be known of contact and leakage without solving for them: theories and exact answers."""
