"""From a recording of a hand to the sizes of that hand."""
