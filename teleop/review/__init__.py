"""What localising a log came to, for people: figures, pictures and a page to read them on."""
