"""What all processes share: messages, wire format, deployment, frame and its rules. Imports no other package."""
