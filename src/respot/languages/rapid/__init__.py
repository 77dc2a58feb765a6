"""ABB RAPID."""
