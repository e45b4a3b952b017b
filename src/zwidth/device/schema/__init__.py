"""The device file's shape: which keys there are, with their units and what each may hold.

    value_types  the kinds of values: numbers, vectors, matrices that are right by themselves
    plant        [plant]
    velocity     [loop.velocity], and the low passes
    loop         [loop]
    operator     [operator]
    friction     [friction] of a plant and of drives
    mechanism    [mechanism]
    device_file  the whole file, and its JSON Schema

What needs two keys to be judged (sizes, names that refer to names, either-or) is checked in
`device.rules`, so that a fault in one key hides none in another.
"""
