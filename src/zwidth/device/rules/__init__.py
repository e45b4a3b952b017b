"""The rules of a device file that take more than one number or key, each stated once.

    rule       what a rule is; how rules read a document, and fault by fault what they say
    loop       rules of [loop], and of a measured [response]
    plant      rules of [plant], of dry friction, of who holds the device and of its [load]
    mechanism  rules of [mechanism] and of the operator's [arm], which is a chain of links, too
    table      all of them, in the order in which their sentences come
    designs    the same rules over arrays: which of many designs are certain to be valid

What a single value must be is said by its type in `device.schema`; of a vector or a matrix as a `ValueRule`, which
arrays of designs are held against, too. What can be told only once a mechanism is built is in
`device.mechanism_check`; numbers that are allowed and look wrong in `device.plausibility`.
"""
