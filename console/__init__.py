"""The console: a page in the browser to see and touch a run, a capture or a replay, and the process that serves it."""
