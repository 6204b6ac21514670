"""AUTO-07p's demos in contin, label by label beside AUTO's own runs: the records and the page of ``scripts/demos.py``."""
