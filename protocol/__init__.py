"""What all processes share: messages, wire format, deployment, frame and the rules over it. Imports no other package."""
