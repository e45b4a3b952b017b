"""What a load does: the chart as the hand pushes harder, and links that bend."""
