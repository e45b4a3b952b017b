"""What figures of several panels are held to."""


def check_legends_lie_beside(made, axes):
    """No legend covers a panel or leaves the figure."""
    made.canvas.draw()
    boxes = [ax.get_window_extent() for ax in axes]
    for ax in axes:
        legend = ax.get_legend().get_window_extent()
        assert not any(legend.overlaps(box) for box in boxes)
        assert legend.x0 >= 0.0
        assert legend.x1 <= made.bbox.x1
