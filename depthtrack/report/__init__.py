"""The report: one HTML page that holds everything it shows, made from run folders alone."""
