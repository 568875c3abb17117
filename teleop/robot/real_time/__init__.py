"""A robot in real time: three processes, so that nothing a client does can hold up what drives."""
