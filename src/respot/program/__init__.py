"""The neutral model of robot programs that both languages are read into."""
