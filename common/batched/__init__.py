"""What components compute for many at once: elementary functions and keyed noise, each with its single form.

A value has the same bits in any batch: alone, first, last, among ten or ten thousand. So there is no sum, product of
matrices or running state here, only operations of element with element that IEEE 754 defines to the last bit.
"""
