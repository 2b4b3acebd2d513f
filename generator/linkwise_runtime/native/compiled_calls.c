/* Calls of a robot's compiled C from Python, without a detour through Python code. The same for every robot: `Calls` is
   made of the addresses of its functions, and answers what needs no second look: NumPy arrays of one shape and dtype,
   float32 or float64, contiguous, whose results are small enough for one thread. Every call is given first its owner,
   an object of a class with methods of the same names: whatever else it is asked, it passes on to these, as it was asked.

   Limited API: one file serves every Python from 3.11 on. */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>
#include <string.h>
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <numpy/arrayobject.h>

enum {
    RESULTS = 5,             /* of a call, at most */
    AXES = 16,               /* of a motion, at most */
    LITTLE = 1 << 15,        /* bytes below which where memory starts is of no account */
    ALONE = 1 << 14          /* bytes of results from which other threads may run meanwhile */
};

enum call {
    PACKED,
    PACKED_TORQUE,
    PARTIAL_TORQUE,
    INVERSE_DYNAMICS,
    COEFFICIENTS,
    PROPAGATION,
    GRADIENT_PROPAGATION,
    POSITION_GRADIENT,
    CALLS
};
static const char *const NAMES[CALLS] = {
    "packed", "packed_torque", "partial_torque", "inverse_dynamics",
    "coefficients", "propagation", "gradient_propagation", "position_gradient",
};

/* What a call answers with: the tuple's type, or none for a single array, and the shapes for one sample. */
struct answer {
    PyObject *kind;
    int results, axes[RESULTS];
    npy_intp shape[RESULTS][3], size[RESULTS], total;
};

/* Functions are by dtype, float64 first; those that nobody has compiled yet are NULL. */
typedef struct {
    PyObject_HEAD
    PyObject *parameters[2]; /* arrays */
    int parametric;          /* whether there is anything in them */
    npy_intp joints, limit;
    struct answer answers[CALLS];
    void *functions[CALLS][2];
} Calls;

/* ---- Which arrays are taken ---- */

/* 0 for float64, 1 for float32, -1 for what is not taken. */
static int dtype_of(PyArrayObject *a)
{
    const int type = PyArray_TYPE(a);
    return type == NPY_DOUBLE ? 0 : type == NPY_FLOAT ? 1 : -1;
}

/* Whether something is an array, and lies in memory as C reads it. */
static int is_plain(PyObject *o)
{
    return PyArray_CheckExact(o) && PyArray_ISCARRAY_RO((PyArrayObject *)o);
}

static int is_like(PyArrayObject *a, int type, int axes, const npy_intp *shape)
{
    if (PyArray_TYPE(a) != type || PyArray_NDIM(a) != axes)
        return 0;
    for (int axis = 0; axis < axes; ++axis)
        if (PyArray_DIM(a, axis) != shape[axis])
            return 0;
    return 1;
}

static int overlap(PyArrayObject *a, PyArrayObject *b)
{
    const uintptr_t first = (uintptr_t)PyArray_DATA(a), other = (uintptr_t)PyArray_DATA(b);
    return first < other + (uintptr_t)PyArray_NBYTES(b) && other < first + (uintptr_t)PyArray_NBYTES(a);
}

/* ---- Memory for results ---- */

/* A new array; unless it is little, it starts on a cache line. */
static PyArrayObject *new_array(int axes, const npy_intp *shape, int type, npy_intp bytes)
{
    if (bytes < LITTLE)
        return (PyArrayObject *)PyArray_SimpleNew(axes, shape, type);
    npy_intp room = bytes + 64;
    PyObject *owner = PyArray_SimpleNew(1, &room, NPY_UINT8);
    if (!owner)
        return NULL;
    char *start = PyArray_BYTES((PyArrayObject *)owner);
    start += -(uintptr_t)start % 64;
    PyObject *made = PyArray_New(&PyArray_Type, axes, shape, type, NULL, start, 0, NPY_ARRAY_CARRAY, NULL);
    if (!made) {
        Py_DECREF(owner);
        return NULL;
    }
    if (PyArray_SetBaseObject((PyArrayObject *)made, owner) < 0) { /* takes the owner, also where it fails */
        Py_DECREF(made);
        return NULL;
    }
    return (PyArrayObject *)made;
}

/* The arrays of `out` that a call's results may be written to, as new references; 0 where somebody has to look twice. */
static int given(const struct answer *answer, PyObject *out, int type, int axes, npy_intp (*shapes)[AXES + 3],
    PyArrayObject *const *motion, int motions, PyArrayObject **results)
{
    if (answer->kind && (!PyTuple_Check(out) || PyTuple_Size(out) != answer->results))
        return 0;
    for (int r = 0; r < answer->results; ++r) {
        PyObject *one = answer->kind ? PyTuple_GetItem(out, r) : out;
        if (!is_plain(one) || !PyArray_ISWRITEABLE((PyArrayObject *)one) ||
            !is_like((PyArrayObject *)one, type, axes + answer->axes[r], shapes[r]))
            return 0;
        results[r] = (PyArrayObject *)one;
        for (int m = 0; m < motions; ++m)
            if (overlap(results[r], motion[m]))
                return 0;
        for (int before = 0; before < r; ++before)
            if (overlap(results[r], results[before]))
                return 0;
    }
    for (int r = 0; r < answer->results; ++r)
        Py_INCREF((PyObject *)results[r]);
    return 1;
}

/* ---- Calling C ---- */

typedef void (*with_4)(size_t, void *, void *, void *, void *);
typedef void (*with_5)(size_t, void *, void *, void *, void *, void *);
typedef void (*with_6)(size_t, void *, void *, void *, void *, void *, void *);
typedef void (*with_7)(size_t, void *, void *, void *, void *, void *, void *, void *);
typedef void (*with_8)(size_t, void *, void *, void *, void *, void *, void *, void *, void *);
typedef void (*with_9)(size_t, void *, void *, void *, void *, void *, void *, void *, void *, void *);

static void call(void *function, size_t count, int arrays, void **a)
{
    switch (arrays) {
    case 4: ((with_4)(uintptr_t)function)(count, a[0], a[1], a[2], a[3]); break;
    case 5: ((with_5)(uintptr_t)function)(count, a[0], a[1], a[2], a[3], a[4]); break;
    case 6: ((with_6)(uintptr_t)function)(count, a[0], a[1], a[2], a[3], a[4], a[5]); break;
    case 7: ((with_7)(uintptr_t)function)(count, a[0], a[1], a[2], a[3], a[4], a[5], a[6]); break;
    case 8: ((with_8)(uintptr_t)function)(count, a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]); break;
    case 9: ((with_9)(uintptr_t)function)(count, a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8]); break;
    }
}

/* One array, or the tuple that a call answers with; takes the references. */
static PyObject *as_answer(const struct answer *answer, PyArrayObject **results)
{
    if (!answer->kind)
        return (PyObject *)results[0];
    PyTypeObject *const kind = (PyTypeObject *)answer->kind;
    PyObject *made = ((allocfunc)PyType_GetSlot(kind, Py_tp_alloc))(kind, answer->results);
    for (int r = 0; r < answer->results; ++r)
        if (made)
            PyTuple_SetItem(made, r, (PyObject *)results[r]);
        else
            Py_DECREF(results[r]);
    return made;
}

/* The answer to a motion, in `out` unless that is None; NULL without an error where somebody has to look twice. */
static PyObject *answered(Calls *self, enum call which, PyObject *const *motion, int motions, PyObject *out)
{
    const struct answer *const answer = &self->answers[which];
    PyArrayObject *read[3], *results[RESULTS];
    for (int m = 0; m < motions; ++m) {
        if (!is_plain(motion[m]))
            return NULL;
        read[m] = (PyArrayObject *)motion[m];
    }
    const int kind = dtype_of(read[0]), type = PyArray_TYPE(read[0]), axes = PyArray_NDIM(read[0]) - 1;
    if (kind < 0 || axes < 0 || axes > AXES || PyArray_DIM(read[0], axes) != self->joints)
        return NULL;
    for (int m = 1; m < motions; ++m)
        if (!is_like(read[m], type, axes + 1, PyArray_DIMS(read[0])))
            return NULL;
    void *const function = self->functions[which][kind];
    npy_intp count = 1;
    for (int axis = 0; axis < axes; ++axis)
        count *= PyArray_DIM(read[0], axis);
    const npy_intp width = kind ? sizeof(float) : sizeof(double);
    if (!function || count > self->limit / (answer->total * width))
        return NULL;

    npy_intp shapes[RESULTS][AXES + 3];
    for (int r = 0; r < answer->results; ++r) {
        for (int axis = 0; axis < axes; ++axis)
            shapes[r][axis] = PyArray_DIM(read[0], axis);
        for (int axis = 0; axis < answer->axes[r]; ++axis)
            shapes[r][axes + axis] = answer->shape[r][axis];
    }
    if (out != Py_None) {
        if (!given(answer, out, type, axes, shapes, read, motions, results))
            return NULL;
    } else {
        for (int r = 0; r < answer->results; ++r) {
            results[r] = new_array(axes + answer->axes[r], shapes[r], type, count * answer->size[r] * width);
            if (!results[r]) {
                while (r--)
                    Py_DECREF(results[r]);
                return NULL;
            }
        }
    }

    void *arrays[3 + 1 + RESULTS];
    int used = 0;
    for (int m = 0; m < motions; ++m)
        arrays[used++] = PyArray_DATA(read[m]);
    if (self->parametric)
        arrays[used++] = PyArray_DATA((PyArrayObject *)self->parameters[kind]);
    for (int r = 0; r < answer->results; ++r)
        if (answer->size[r]) /* a robot may have none of a kind */
            arrays[used++] = PyArray_DATA(results[r]);
    if (count * answer->total * width < ALONE) {
        call(function, (size_t)count, used, arrays);
    } else {
        Py_BEGIN_ALLOW_THREADS
        call(function, (size_t)count, used, arrays);
        Py_END_ALLOW_THREADS
    }
    if (out != Py_None && !answer->kind) {
        Py_DECREF(results[0]);
        Py_INCREF(out);
        return out;
    }
    return as_answer(answer, results);
}

/* ---- The calls ---- */

/* What the method of the owner's class says; the owner is the first argument. */
static PyObject *pass_on(const char *name, PyObject *const *arguments, Py_ssize_t count, PyObject *names)
{
    if (!count)
        return PyErr_Format(PyExc_TypeError, "%s() is called without its owner", name);
    const Py_ssize_t named = names ? PyTuple_Size(names) : 0;
    PyObject *answer = NULL, *by_name = NULL, *in_order = PyTuple_New(count);
    PyObject *method = PyObject_GetAttrString((PyObject *)Py_TYPE(arguments[0]), name);
    if (!method || !in_order || (named && !(by_name = PyDict_New())))
        goto done;
    for (Py_ssize_t a = 0; a < count; ++a) {
        Py_INCREF(arguments[a]);
        PyTuple_SetItem(in_order, a, arguments[a]);
    }
    for (Py_ssize_t a = 0; a < named; ++a)
        if (PyDict_SetItem(by_name, PyTuple_GetItem(names, a), arguments[count + a]) < 0)
            goto done;
    answer = PyObject_Call(method, in_order, by_name);
done:
    Py_XDECREF(by_name);
    Py_XDECREF(in_order);
    Py_XDECREF(method);
    return answer;
}

/* What a call may be told after its owner; NULL, or None for `out`, where it is not told. */
enum told { Q, QD, QDD, CONVENTION, OUT, TOLD };
static const char *const WORDS[TOLD] = {"q", "qd", "qdd", "convention", "out"};
enum { HAS_QDD = 1 << QDD, HAS_CONVENTION = 1 << CONVENTION, ALWAYS = 1 << Q | 1 << QD | 1 << OUT };

/* Arguments where they belong, of those that a call has; 0 where there is one too few, too many, or twice. */
static int sorted(int has, PyObject *const *arguments, Py_ssize_t count, PyObject *names, PyObject **told)
{
    Py_ssize_t used = 1; /* the first is the owner */
    for (int t = 0; t < TOLD; ++t)
        told[t] = has >> t & 1 && used < count ? arguments[used++] : NULL;
    if (used < count)
        return 0;
    const Py_ssize_t named = names ? PyTuple_Size(names) : 0;
    for (Py_ssize_t a = 0; a < named; ++a) {
        int t = 0;
        while (t < TOLD && PyUnicode_CompareWithASCIIString(PyTuple_GetItem(names, a), WORDS[t]))
            ++t;
        if (t == TOLD || !(has >> t & 1) || told[t])
            return 0;
        told[t] = arguments[count + a];
    }
    if (!told[OUT])
        told[OUT] = Py_None;
    return told[Q] && told[QD] && (told[QDD] || !(has & HAS_QDD));
}

#define METHOD(name, which, has)                                                                                        \
    static PyObject *name(PyObject *self, PyObject *const *arguments, Py_ssize_t count, PyObject *names)                \
    {                                                                                                                   \
        PyObject *told[TOLD], *answer = NULL;                                                                           \
        if (sorted(has, arguments, count, names, told))                                                                 \
            answer = answered((Calls *)self, which, told, (has) & HAS_QDD ? 3 : 2, told[OUT]);                          \
        return answer || PyErr_Occurred() ? answer : pass_on(#name, arguments, count, names);                           \
    }
METHOD(packed, PACKED, ALWAYS | HAS_QDD)
METHOD(packed_torque, PACKED_TORQUE, ALWAYS | HAS_QDD)
METHOD(partial_torque, PARTIAL_TORQUE, ALWAYS | HAS_QDD)
METHOD(inverse_dynamics, INVERSE_DYNAMICS, ALWAYS | HAS_QDD)
METHOD(coefficients, COEFFICIENTS, ALWAYS)
METHOD(position_gradient, POSITION_GRADIENT, ALWAYS | HAS_QDD)

static PyObject *propagation(PyObject *self, PyObject *const *arguments, Py_ssize_t count, PyObject *names)
{
    PyObject *told[TOLD], *answer = NULL;
    if (sorted(ALWAYS | HAS_QDD | HAS_CONVENTION, arguments, count, names, told)) {
        PyObject *const word = told[CONVENTION];
        if (!word || (PyUnicode_Check(word) && !PyUnicode_CompareWithASCIIString(word, "closing")))
            answer = answered((Calls *)self, PROPAGATION, told, 3, told[OUT]);
        else if (PyUnicode_Check(word) && !PyUnicode_CompareWithASCIIString(word, "gradient"))
            answer = answered((Calls *)self, GRADIENT_PROPAGATION, told, 3, told[OUT]);
    }
    return answer || PyErr_Occurred() ? answer : pass_on("propagation", arguments, count, names);
}

/* (call, dtype's number, address): a function that has been compiled since. */
static PyObject *learn(PyObject *self, PyObject *arguments)
{
    const char *name;
    int kind;
    Py_ssize_t address;
    if (!PyArg_ParseTuple(arguments, "sin:learn", &name, &kind, &address))
        return NULL;
    for (int which = 0; which < CALLS; ++which)
        if (!strcmp(name, NAMES[which]) && (kind == 0 || kind == 1))
            ((Calls *)self)->functions[which][kind] = (void *)(uintptr_t)address;
    Py_RETURN_NONE;
}

/* ---- Its life ---- */

/* From (kind, shapes) of a call. */
static int read_answer(struct answer *answer, PyObject *kind, PyObject *shapes)
{
    const Py_ssize_t results = PyTuple_Size(shapes);
    if (results < 1 || results > RESULTS) {
        if (!PyErr_Occurred())
            PyErr_SetString(PyExc_ValueError, "a call has one to five results");
        return -1;
    }
    if (kind != Py_None && !(PyType_Check(kind) && PyType_IsSubtype((PyTypeObject *)kind, &PyTuple_Type))) {
        PyErr_SetString(PyExc_TypeError, "several results make a type of tuple");
        return -1;
    }
    answer->results = (int)results;
    for (int r = 0; r < results; ++r) {
        PyObject *shape = PyTuple_GetItem(shapes, r);
        const Py_ssize_t axes = PyTuple_Size(shape);
        if (axes < 1 || axes > 3) {
            if (!PyErr_Occurred())
                PyErr_SetString(PyExc_ValueError, "a result has one to three axes for a sample");
            return -1;
        }
        answer->axes[r] = (int)axes;
        answer->size[r] = 1;
        for (int axis = 0; axis < axes; ++axis) {
            const Py_ssize_t size = PyLong_AsSsize_t(PyTuple_GetItem(shape, axis));
            if (size < 0)
                return -1;
            answer->shape[r][axis] = size;
            answer->size[r] *= size;
        }
        answer->total += answer->size[r];
    }
    if (kind != Py_None) {
        Py_INCREF(kind);
        answer->kind = kind;
    }
    return 0;
}

/* Calls(joints, limit, parameters as float64, as float32, {call: (type of tuple or None, shapes)}) */
static PyObject *calls_new(PyTypeObject *type, PyObject *arguments, PyObject *Py_UNUSED(named))
{
    PyObject *parameters[2], *answers;
    Py_ssize_t joints, limit;
    if (!PyArg_ParseTuple(arguments, "nnO!O!O!:Calls", &joints, &limit, &PyArray_Type, &parameters[0], &PyArray_Type,
            &parameters[1], &PyDict_Type, &answers))
        return NULL;
    if (joints < 1 || !is_plain(parameters[0]) || !is_plain(parameters[1])) {
        PyErr_SetString(PyExc_ValueError, "joints are one or more, parameters plain arrays");
        return NULL;
    }
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    Calls *self = (Calls *)allocate(type, 0);
    if (!self)
        return NULL;
    self->joints = joints;
    self->limit = limit;
    for (int kind = 0; kind < 2; ++kind) {
        Py_INCREF(parameters[kind]);
        self->parameters[kind] = parameters[kind];
        self->parametric = PyArray_SIZE((PyArrayObject *)parameters[kind]) > 0;
    }
    for (int which = 0; which < CALLS; ++which) {
        PyObject *answer = PyDict_GetItemString(answers, NAMES[which]), *kind, *shapes;
        if (!answer)
            PyErr_Format(PyExc_KeyError, "%s", NAMES[which]);
        if (!answer || !PyArg_ParseTuple(answer, "OO!", &kind, &PyTuple_Type, &shapes) ||
            read_answer(&self->answers[which], kind, shapes) < 0) {
            Py_DECREF(self);
            return NULL;
        }
    }
    return (PyObject *)self;
}

static int calls_traverse(PyObject *object, visitproc visit, void *arg)
{
    Calls *self = (Calls *)object;
    Py_VISIT(Py_TYPE(object));
    for (int kind = 0; kind < 2; ++kind)
        Py_VISIT(self->parameters[kind]);
    for (int which = 0; which < CALLS; ++which)
        Py_VISIT(self->answers[which].kind);
    return 0;
}

static void calls_dealloc(PyObject *object)
{
    Calls *self = (Calls *)object;
    PyTypeObject *type = Py_TYPE(object);
    PyObject_GC_UnTrack(object);
    for (int kind = 0; kind < 2; ++kind)
        Py_CLEAR(self->parameters[kind]);
    for (int which = 0; which < CALLS; ++which)
        Py_CLEAR(self->answers[which].kind);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(object);
    Py_DECREF(type);
}

/* Python reads signatures from the first lines. */
#define FAST(name, told)                                                                                                \
    {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL | METH_KEYWORDS,                                           \
     #name "($self, owner, /, " told "out=None)\n--\n\nSee `Dynamics." #name "`."}
static PyMethodDef methods[] = {
    FAST(packed, "q, qd, qdd, "), FAST(packed_torque, "q, qd, qdd, "), FAST(partial_torque, "q, qd, qdd, "),
    FAST(inverse_dynamics, "q, qd, qdd, "), FAST(coefficients, "q, qd, "),
    FAST(propagation, "q, qd, qdd, convention='closing', "), FAST(position_gradient, "q, qd, qdd, "),
    {"learn", learn, METH_VARARGS, NULL}, {NULL, NULL, 0, NULL},
};
static PyType_Slot slots[] = {
    {Py_tp_new, (void *)calls_new}, {Py_tp_dealloc, (void *)calls_dealloc}, {Py_tp_methods, methods},
    {Py_tp_traverse, (void *)calls_traverse}, {0, NULL},
};
static PyType_Spec spec = {"compiled_calls.Calls", sizeof(Calls), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, slots};

static int fill(PyObject *module)
{
    import_array1(-1);
    PyObject *type = PyType_FromModuleAndSpec(module, &spec, NULL);
    if (!type || PyModule_AddObjectRef(module, "Calls", type) < 0) {
        Py_XDECREF(type);
        return -1;
    }
    Py_DECREF(type);
    return 0;
}

static PyModuleDef_Slot phases[] = {{Py_mod_exec, (void *)fill}, {0, NULL}};
static PyModuleDef definition = {PyModuleDef_HEAD_INIT, "compiled_calls", NULL, 0, NULL, phases, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit_compiled_calls(void);
PyMODINIT_FUNC PyInit_compiled_calls(void)
{
    return PyModuleDef_Init(&definition);
}
