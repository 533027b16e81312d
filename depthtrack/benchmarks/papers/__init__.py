"""The papers' experiments: what each varies and measures, what the paper says of it, and how both are drawn."""
