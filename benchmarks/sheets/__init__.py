"""The sheets of ``docs/sheets``, made of kept figures and of the code."""
