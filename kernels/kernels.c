/* The module `_kernels`: the functions of the other C files for Python. Arrays are C-contiguous buffers. */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "raster.c"
#include "rays.c"

static PyMethodDef methods[] = {
    {"first_hits", first_hits, METH_VARARGS, NULL},
    {"turned", turned, METH_VARARGS, NULL},
    {"raster", raster, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL},
};

static PyModuleDef_Slot slots[] = {{0, NULL}};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, .m_name = "_kernels", .m_methods = methods, .m_slots = slots};

PyMODINIT_FUNC PyInit__kernels(void) { return PyModuleDef_Init(&module); }
