"""The server: pages over HTTP, a WebSocket for each browser."""
