"""A map: how stiff a wall the five-bar renders along y, over its workspace, and where that is good enough.

A map is an xarray dataset over the handle's position; cells that the handle does not reach hold nan. Requirements
are laid over each other on it, and what they have in common has an area. Towards postures in which the handle
hardly moves along y the largest stiffness grows without bound, so that a map's best cell says little, and its
worst one more.
"""

import zwidth

device = zwidth.load("five-bar")
plane = zwidth.study.plane_of(device, cells=(41, 21))
maps = zwidth.workspace_map(device, ["stiffness_max", "isotropy"], plane)

worst = maps.isel(maps["stiffness_max"].argmin(...))
print(f"least: {worst.stiffness_max:.0f} N/m at ({worst.x_m:.3f}, {worst.y_m:.3f}) m")

wanted = [zwidth.study.parse_requirement(text) for text in ("stiffness_max>=6000", "isotropy<=1.5")]
good = zwidth.study.common_area(maps, wanted)
print(f"at least 6 kN/m and a condition number of at most 1.5: {1e4 * good.common.area:.0f} cm²")


def figure():
    """The largest stiffness, the requirements over it, and the mechanism in its reference posture."""
    from zwidth.show import map_figure

    return map_figure(maps, "stiffness_max", device, good).axes[0]


if __name__ == "__main__":
    figure().figure.savefig("first_06_a_map.png")
