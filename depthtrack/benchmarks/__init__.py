"""Speed on this machine, and the experiments of the papers."""
