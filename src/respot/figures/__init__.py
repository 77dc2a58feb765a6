"""Pages and pictures of results; what a page says is shared with the terminal."""
