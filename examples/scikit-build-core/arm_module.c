/* The emitted C as a module of Python. Motions come as buffers of doubles, one row of joints a sample. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "arm.h"

#define ROW ((Py_ssize_t)(ARM_JOINTS * sizeof(double)))

static int fits(const Py_buffer *buffer, Py_ssize_t length)
{
    return buffer->itemsize == (Py_ssize_t)sizeof(double) && buffer->len == length;
}

static PyObject *inverse_dynamics(PyObject *module, PyObject *arguments)
{
    Py_buffer q, qd, qdd, tau;
    PyObject *answer = NULL;
    (void)module;
    if (!PyArg_ParseTuple(arguments, "y*y*y*w*:inverse_dynamics", &q, &qd, &qdd, &tau))
        return NULL;
    if (q.len % ROW || !fits(&q, q.len) || !fits(&qd, q.len) || !fits(&qdd, q.len) || !fits(&tau, q.len)) {
        PyErr_Format(PyExc_ValueError, "q, qd, qdd and tau must be equally many doubles, %d a sample", ARM_JOINTS);
    } else {
        Py_BEGIN_ALLOW_THREADS
        arm_inverse_dynamics((size_t)(q.len / ROW), q.buf, qd.buf, qdd.buf, tau.buf);
        Py_END_ALLOW_THREADS
        answer = Py_NewRef(Py_None);
    }
    PyBuffer_Release(&q);
    PyBuffer_Release(&qd);
    PyBuffer_Release(&qdd);
    PyBuffer_Release(&tau);
    return answer;
}

static PyMethodDef functions[] = {
    {"inverse_dynamics", inverse_dynamics, METH_VARARGS,
     "inverse_dynamics(q, qd, qdd, tau): joint torques, N m, of each sample, written into tau."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_arm", NULL, 0, functions, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__arm(void)
{
    PyObject *module = PyModule_Create(&definition);
    if (module && PyModule_AddIntConstant(module, "JOINTS", ARM_JOINTS) < 0)
        Py_CLEAR(module);
    return module;
}
