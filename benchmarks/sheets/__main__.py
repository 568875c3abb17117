"""``python -m benchmarks.sheets``: write the sheets of the docs."""

from benchmarks.sheets.pages import main

main()
