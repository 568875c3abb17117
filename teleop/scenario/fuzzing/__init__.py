"""The fuzzer: draws whole sessions, judges them by rules that hold in every run, and shrinks what breaks one."""
