"""Files of optical marker captures: one module a format, chosen by content."""
