"""Draw runs, records and studies, and write the page about a run. matplotlib is imported when something is drawn."""
