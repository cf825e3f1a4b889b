"""Neighbour pairs of each connectivity written out pixel by pixel, as a reference for tests."""


def edges(shape, connectivity, periodic):
    """All pairs of neighbouring sites of a grid, from the definition of the connectivity."""
    nx, ny = shape
    for i in range(nx):
        for j in range(ny):
            pairs = [((i, j), (i + 1, j)), ((i, j), (i, j + 1))]
            rising, falling = ((i, j), (i + 1, j + 1)), ((i + 1, j), (i, j + 1))
            if connectivity == "8":
                pairs += [rising, falling]
            if connectivity == "triangulation":
                pairs += [rising if (i + j) % 2 == 0 else falling]
            for a, b in pairs:
                crosses_x = max(a[0], b[0]) == nx
                crosses_y = max(a[1], b[1]) == ny
                if (crosses_x and not periodic[0]) or (crosses_y and not periodic[1]):
                    continue
                yield (a[0] % nx, a[1] % ny), (b[0] % nx, b[1] % ny)
