"""What changes the largest stiffness, and by how much: derivatives, and one thing made ideal at a time."""
