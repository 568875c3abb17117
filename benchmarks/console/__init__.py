"""The console page in Chromium."""
