"""The whole mechanism in contact: large motions on flexible drives, and surfaces anywhere in the workspace."""
