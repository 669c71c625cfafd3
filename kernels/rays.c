/* The first hits of rays on placed shapes: world/rays/casting.py is the same in numpy, bit for bit.

A ray is computed exactly on each shape that it comes near to, with the operations of the twin in their order. Which
shapes those are is found otherwise: the sphere around a shape against a cone around PIECE rays, then against each ray.
Neither changes a distance, of which the least is taken; of equal ones that of the first shape. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define PIECE 12 /* A narrower cone has fewer near shapes, and each cone costs a comparison with all. */
#define SHELLS 32 /* About the start of rays, of equal width. */
#define BLOCK 32 /* Triangles in a block, as in triangles.py. */
#define TOUCH_M 1e-9
#define STEP_MIN 1e-30

enum { BOX, CYLINDER, SPHERE, MESH, CAPSULE };

typedef struct { double enter, leave; } Span;
typedef struct { const double *boxes, *corners; int64_t blocks; int closed; } Mesh;
typedef struct { double *places; size_t count, size; } Places;
typedef struct { double position[3], rows[3][3], half[3]; int64_t form; const Mesh *mesh; } Shape; /* One in a row: near in memory. */
typedef struct {
    int64_t count;                          /* Shapes; each column below has a number for each. */
    const double *columns, *radii, *half;   /* (15, count): positions, middles, rows; (count,); (3, count) */
    const int64_t *forms, *things, *meshes; /* Of the last, the number of its mesh, -1 without one. */
    const Mesh *mesh;
    Shape *shapes;
    Places hits;
} Shapes;

static const Span MISSED = {INFINITY, -INFINITY};

static double lesser(double a, double b) { return a < b ? a : b; }
static double greater(double a, double b) { return a > b ? a : b; }

static Span in_box(const double *s, const double *w, const double *half) {
    Span span = {-INFINITY, INFINITY};
    for (int i = 0; i < 3; i++) {
        if (w[i] == 0.0) {
            if (!(-half[i] < s[i] && s[i] < half[i])) return MISSED;
            continue;
        }
        double one = (-half[i] - s[i]) / w[i], other = (half[i] - s[i]) / w[i];
        span.enter = greater(span.enter, lesser(one, other)), span.leave = lesser(span.leave, greater(one, other));
    }
    return span.enter < span.leave ? span : MISSED;
}

static Span in_sphere(double x, double y, double z, const double *w, double radius) {
    double middle = -(x * w[0] + y * w[1] + z * w[2]);
    x = x + middle * w[0], y = y + middle * w[1], z = z + middle * w[2];
    double rest = radius * radius - (x * x + y * y + z * z);
    if (!(rest > 0.0)) return MISSED;
    double half = sqrt(rest);
    return (Span){middle - half, middle + half};
}

static Span in_cylinder(const double *s, const double *w, double radius, double half_length) {
    Span span = {-INFINITY, INFINITY};
    double x = s[0], y = s[1], z = s[2], across = w[0] * w[0] + w[1] * w[1];
    double divisor = across == 0.0 ? 1.0 : across;
    double middle = -(x * w[0] + y * w[1]) / divisor;
    x = x + middle * w[0], y = y + middle * w[1];
    double rest = radius * radius - (x * x + y * y);
    if (!(rest > 0.0)) return MISSED;
    if (across != 0.0) {
        double half = sqrt(rest / divisor);
        span = (Span){middle - half, middle + half};
    }
    if (w[2] == 0.0) {
        if (!(-half_length < z && z < half_length)) return MISSED;
    } else {
        double one = (-half_length - z) / w[2], other = (half_length - z) / w[2];
        span.enter = greater(span.enter, lesser(one, other)), span.leave = lesser(span.leave, greater(one, other));
    }
    return span.enter < span.leave ? span : MISSED;
}

static Span in_capsule(const double *s, const double *w, double radius, double half_length) {
    Span span = in_cylinder(s, w, radius, half_length);
    for (int end = -1; end <= 1; end += 2) {
        Span ball = in_sphere(s[0], s[1], s[2] - end * half_length, w, radius);
        span.enter = lesser(span.enter, ball.enter), span.leave = greater(span.leave, ball.leave);
    }
    return span;
}

static double entry(double enter, double leave, double range) {
    enter = enter > 0.0 ? enter : 0.0;
    return lesser(leave, range) - enter > TOUCH_M ? enter : INFINITY;
}

static int is_left(double edge, double dx, double dy) {
    return edge > 0.0 || (edge == 0.0 && (dy > 0.0 || (dy == 0.0 && dx < 0.0)));
}

static int compared(const void *a, const void *b) {
    double one = *(const double *)a, other = *(const double *)b;
    return (one > other) - (one < other);
}

/* Add where a line passes through the triangles of a block; return 0 without memory. */
static int through_block(const Mesh *mesh, int64_t block, const double *s, const double *w, int along, Places *hits) {
    int one = (along + 1) % 3, other = (along + 2) % 3;
    double tilt_x = w[one] / w[along], tilt_y = w[other] / w[along];
    const double *corner[3][3]; /* By coordinate, then corner; the coordinates are those seen along the line. */
    const int axes[3] = {one, other, along};
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 3; i++) corner[axis][i] = mesh->corners + ((axes[axis] * 3 + i) * mesh->blocks + block) * BLOCK;
    for (int t = 0; t < BLOCK; t++) {
        double x[3], y[3], z[3], edge[3];
        int left = 0;
        for (int i = 0; i < 3; i++) {
            z[i] = corner[2][i][t] - s[along];
            x[i] = (corner[0][i][t] - s[one]) - tilt_x * z[i];
            y[i] = (corner[1][i][t] - s[other]) - tilt_y * z[i];
        }
        for (int i = 0; i < 3; i++) {
            int a = (i + 1) % 3, b = (i + 2) % 3;
            edge[i] = x[a] * y[b] - x[b] * y[a];
            left += is_left(edge[i], x[b] - x[a], y[b] - y[a]);
        }
        double area = edge[0] + edge[1] + edge[2];
        if ((left != 0 && left != 3) || area == 0.0) continue;
        if (hits->count == hits->size) {
            size_t size = hits->size ? 2 * hits->size : 64;
            double *places = realloc(hits->places, size * sizeof *places);
            if (!places) return 0;
            hits->places = places, hits->size = size;
        }
        hits->places[hits->count++] = (edge[0] * z[0] + edge[1] * z[1] + edge[2] * z[2]) / area / w[along];
    }
    return 1;
}

/* Return where a line enters a mesh, or passes a wall of an open one; NaN without memory. */
static double into_mesh(const Mesh *mesh, const double *s, const double *w, double range, Places *hits) {
    double step[3], least = INFINITY;
    int along = 0;
    for (int i = 0; i < 3; i++) {
        step[i] = fabs(w[i]) < STEP_MIN ? STEP_MIN : w[i];
        if (fabs(w[i]) > fabs(w[along])) along = i;
    }
    hits->count = 0;
    for (int64_t block = 0; block < mesh->blocks; block++) {
        double first = -INFINITY, last = INFINITY;
        for (int i = 0; i < 3; i++) {
            double one = (mesh->boxes[i * mesh->blocks + block] - s[i]) / step[i];
            double other = (mesh->boxes[(3 + i) * mesh->blocks + block] - s[i]) / step[i];
            first = greater(first, lesser(one, other)), last = lesser(last, greater(one, other));
        }
        if (first <= last && !through_block(mesh, block, s, w, along, hits)) return NAN;
    }
    if (mesh->closed) {
        qsort(hits->places, hits->count, sizeof *hits->places, compared);
        for (size_t i = 0; i + 1 < hits->count && least == INFINITY; i += 2)
            least = entry(hits->places[i], hits->places[i + 1], range);
    } else {
        for (size_t i = 0; i < hits->count; i++)
            if (hits->places[i] > 0.0 && hits->places[i] < range) least = lesser(least, hits->places[i]);
    }
    return least;
}

static void gather(Shapes *shapes) {
    for (int64_t n = 0; n < shapes->count; n++) {
        Shape *one = shapes->shapes + n;
        for (int i = 0; i < 3; i++) {
            one->position[i] = shapes->columns[i * shapes->count + n], one->half[i] = shapes->half[i * shapes->count + n];
            for (int j = 0; j < 3; j++) one->rows[i][j] = shapes->columns[(6 + 3 * i + j) * shapes->count + n];
        }
        one->form = shapes->forms[n], one->mesh = shapes->meshes[n] < 0 ? NULL : shapes->mesh + shapes->meshes[n];
    }
}

static void local(const Shape *shape, const double *vector, double *out) {
    for (int i = 0; i < 3; i++)
        out[i] = shape->rows[i][0] * vector[0] + shape->rows[i][1] * vector[1] + shape->rows[i][2] * vector[2];
}

/* Meet a shape with a ray whose start is known in its frame; NaN without memory. */
static double meet(const Shape *shape, const double *start, const double *way, double range, Places *hits) {
    double w[3];
    const double *half = shape->half;
    local(shape, way, w);
    Span span;
    switch (shape->form) {
    case BOX: span = in_box(start, w, half); break;
    case SPHERE: span = in_sphere(start[0], start[1], start[2], w, half[0]); break;
    case CYLINDER: span = in_cylinder(start, w, half[0], half[2]); break;
    case CAPSULE: span = in_capsule(start, w, half[0], half[2]); break;
    default: return into_mesh(shape->mesh, start, w, range, hits);
    }
    return entry(span.enter, span.leave, range);
}

/* The sphere around a shape: its middle from the rays' start, its radius, the way to where rays touch it and its square,
   a bound for rounding, its shell, and a place that no ray meets the shape before. */
typedef struct { int64_t shape; double x, y, z, radius, tangent, beyond, slack, begin; int shell; } Near;

/* Find the shapes within the range of a start, the nearer ones first, but for those of one of SHELLS. */
static int64_t within(const Shapes *shapes, const double *start, double range, int64_t passed, double *squares,
                      Near *near, Near *unsorted) {
    const double *x = shapes->columns + 3 * shapes->count, *y = x + shapes->count, *z = y + shapes->count;
    int64_t found = 0, ends[SHELLS + 1] = {0};
    for (int64_t i = 0; i < shapes->count; i++) {
        double dx = x[i] - start[0], dy = y[i] - start[1], dz = z[i] - start[2], reach = range + shapes->radii[i];
        squares[i] = dx * dx + dy * dy + dz * dz - reach * reach * 1.000001;
    }
    for (int64_t i = 0; i < shapes->count; i++) {
        if (squares[i] > 0.0 || shapes->things[i] == passed) continue;
        double dx = x[i] - start[0], dy = y[i] - start[1], dz = z[i] - start[2], radius = shapes->radii[i];
        double square = dx * dx + dy * dy + dz * dz, beyond = square - radius * radius;
        /* Also of a range of 0 or without an end. */
        int shell = beyond > 0.0 && range > 0.0 ? (int)lesser((sqrt(square) - radius) / range * SHELLS, SHELLS - 1) : 0;
        double slack = 1e-9 * (fabs(dx) + fabs(dy) + fabs(dz) + 1.0), tangent = beyond > 0.0 ? sqrt(beyond) : 0.0;
        unsorted[found++] = (Near){i, dx, dy, dz, radius, tangent, beyond, slack,
                                   (shell ? shell * range / SHELLS : 0.0) - slack, shell};
        ends[shell + 1]++;
    }
    for (int i = 0; i < SHELLS; i++) ends[i + 1] += ends[i];
    for (int64_t n = 0; n < found; n++) near[ends[unsorted[n].shell]++] = unsorted[n];
    return found;
}

/* A cone around rays from its tip; where they spread too far it is none, and nothing is outside of it. */
typedef struct { double axis[3], cosine, sine; int is_some; } Cone;

static Cone cone_around(const double *ways, int64_t stride, int64_t rays) {
    Cone cone = {{0.0, 0.0, 0.0}, 1.0, 0.0, 0};
    for (int64_t k = 0; k < rays; k++)
        for (int i = 0; i < 3; i++) cone.axis[i] += ways[i * stride + k];
    double length = sqrt(cone.axis[0] * cone.axis[0] + cone.axis[1] * cone.axis[1] + cone.axis[2] * cone.axis[2]);
    if (length < 0.1 * (double)rays) return cone;
    for (int i = 0; i < 3; i++) cone.axis[i] /= length;
    for (int64_t k = 0; k < rays; k++) {
        double along = cone.axis[0] * ways[k] + cone.axis[1] * ways[stride + k] + cone.axis[2] * ways[2 * stride + k];
        cone.cosine = lesser(cone.cosine, along - 1e-9);
    }
    cone.is_some = cone.cosine > 0.0;
    cone.sine = sqrt(greater(1.0 - cone.cosine * cone.cosine, 0.0));
    return cone;
}

/* Whether a sphere is outside of a cone: its middle is further from the axis than both half angles together. */
static int is_outside(const Cone *cone, const Near *one) {
    double along = cone->axis[0] * one->x + cone->axis[1] * one->y + cone->axis[2] * one->z;
    return cone->is_some && one->beyond > 0.0 && along < cone->cosine * one->tangent - cone->sine * one->radius - one->slack;
}

/* Meet shapes with at most PIECE rays of one start, whose ways are (3, stride); return 0 without memory. */
static int piece(Shapes *shapes, const Near *near, int64_t count, const double *start, const double *ways, int64_t stride,
                 int rays, double range, double *distances, int64_t *things) {
    double way[PIECE][3], farthest = range; /* Where the last of the rays ends, as far as is known. */
    int64_t first[PIECE] = {0};
    Cone cone = cone_around(ways, stride, rays);
    for (int k = 0; k < rays; k++)
        for (int i = 0; i < 3; i++) way[k][i] = ways[i * stride + k];
    for (int64_t n = 0; n < count && near[n].begin <= farthest; n++) {
        const Near *one = near + n;
        if (is_outside(&cone, one)) continue;
        const Shape *shape = shapes->shapes + one->shape;
        double begin[3];
        int is_placed = 0, is_met = 0;
        for (int k = 0; k < rays; k++) {
            double along = way[k][0] * one->x + way[k][1] * one->y + way[k][2] * one->z;
            if (along < -one->radius || along * along < one->beyond) continue;
            if (along - one->radius > lesser(range, distances[k])) continue; /* It is farther away than what was met. */
            if (!is_placed) {
                double from[3];
                for (int i = 0; i < 3; i++) from[i] = start[i] - shape->position[i];
                local(shape, from, begin);
                is_placed = 1;
            }
            double distance = meet(shape, begin, way[k], range, &shapes->hits);
            if (isnan(distance)) return 0;
            if (distance < distances[k] || (distance == distances[k] && one->shape < first[k])) {
                distances[k] = distance, first[k] = one->shape;
            }
            is_met |= distance < farthest;
        }
        if (!is_met) continue;
        farthest = distances[0];
        for (int k = 1; k < rays; k++) farthest = greater(farthest, distances[k]);
        farthest = lesser(farthest, range);
    }
    for (int k = 0; k < rays && things; k++)
        if (distances[k] < INFINITY) things[k] = shapes->things[first[k]];
    return 1;
}

/* bundles: origins (3, count), ranges, passed, starts, lengths (count,); ways (3, rays). Out: (rays,) each. */
static int cast_all(Shapes *shapes, int64_t count, const double *origins, const double *ranges, const int64_t *passed,
                    const int64_t *starts, const int64_t *lengths, int64_t rays, const double *ways,
                    double *distances, int64_t *things) {
    Near *near = malloc(2 * (size_t)(shapes->count + 1) * sizeof *near), *some = near + shapes->count + 1;
    double *squares = malloc((size_t)(shapes->count + 1) * sizeof *squares);
    shapes->shapes = malloc((size_t)(shapes->count + 1) * sizeof *shapes->shapes);
    int is_done = near && squares && shapes->shapes;
    int64_t found = 0;
    if (is_done) gather(shapes);
    for (int64_t k = 0; k < rays; k++) {
        distances[k] = INFINITY;
        if (things) things[k] = -1;
    }
    for (int64_t b = 0; b < count && is_done; b++) {
        const double start[3] = {origins[b], origins[count + b], origins[2 * count + b]};
        int is_known = b > 0 && ranges[b] == ranges[b - 1] && passed[b] == passed[b - 1];
        for (int i = 0; i < 3; i++) is_known = is_known && start[i] == origins[i * count + b - 1];
        if (!is_known) found = within(shapes, start, ranges[b], passed[b], squares, near, some);
        int64_t few = 0; /* Those of a whole bundle are found first, for its pieces. */
        Cone cone = cone_around(ways + starts[b], rays, lengths[b]);
        for (int64_t n = 0; n < found; n++)
            if (!is_outside(&cone, near + n)) some[few++] = near[n];
        for (int64_t k = 0; k < lengths[b] && is_done; k += PIECE) {
            int64_t at = starts[b] + k;
            int size = lengths[b] - k < PIECE ? (int)(lengths[b] - k) : PIECE;
            is_done = piece(shapes, some, few, start, ways + at, rays, size, ranges[b], distances + at, things ? things + at : NULL);
        }
    }
    free(near), free(squares), free(shapes->shapes), free(shapes->hits.places);
    return is_done;
}

/* Whether arrays, in the order of first_hits, fit together: sizes, forms and meshes of shapes, rays of bundles. */
static int fit(const Py_buffer *in, Py_ssize_t meshes, int64_t rays) {
    int64_t shapes = in[1].len / 8, bundles = in[7].len / 8, *forms = in[3].buf, *mesh = in[5].buf;
    const int64_t *starts = in[9].buf, *lengths = in[10].buf;
    const int64_t counts[12] = {15 * shapes, shapes,  3 * shapes, shapes,  shapes,  shapes,
                                3 * bundles, bundles, bundles,    bundles, bundles, 3 * rays};
    int fits = 1;
    for (int i = 0; i < 12; i++) fits = fits && in[i].len == counts[i] * 8;
    for (int64_t n = 0; fits && n < shapes; n++)
        fits = forms[n] >= BOX && forms[n] <= CAPSULE && mesh[n] >= -(forms[n] != MESH) && mesh[n] < meshes;
    for (int64_t b = 0; fits && b < bundles; b++)
        fits = starts[b] >= 0 && lengths[b] >= 0 && lengths[b] <= rays - starts[b];
    return fits;
}

/* first_hits(columns, radii, half, forms, things, mesh numbers, ((boxes, corners, is closed), ...), origins, ranges,
passed, starts, lengths, ways, distances, things or None) */
static PyObject *first_hits(PyObject *Py_UNUSED(self), PyObject *arguments) {
    Py_buffer in[12], out, named = {0};
    PyObject *meshes, *named_in;
    if (!PyArg_ParseTuple(arguments, "y*y*y*y*y*y*O!y*y*y*y*y*y*w*O", in, in + 1, in + 2, in + 3, in + 4, in + 5,
                          &PyTuple_Type, &meshes, in + 6, in + 7, in + 8, in + 9, in + 10, in + 11, &out, &named_in))
        return NULL;
    Py_ssize_t count = PyTuple_Size(meshes), parsed = 0;
    Mesh *mesh = calloc((size_t)count + 1, sizeof *mesh);
    Py_buffer *held = calloc(2 * (size_t)count + 1, sizeof *held);
    int fits = 1, is_done = mesh && held && (named_in == Py_None || PyObject_GetBuffer(named_in, &named, PyBUF_WRITABLE) == 0);
    if (!mesh || !held) PyErr_NoMemory();
    for (; is_done && parsed < count; parsed++) {
        Py_buffer *boxes = held + 2 * parsed;
        if (!PyArg_ParseTuple(PyTuple_GetItem(meshes, parsed), "y*y*p", boxes, boxes + 1, &mesh[parsed].closed)) {
            is_done = 0;
            break;
        }
        mesh[parsed].boxes = boxes->buf, mesh[parsed].corners = boxes[1].buf;
        mesh[parsed].blocks = boxes->len / (Py_ssize_t)(6 * sizeof(double));
        fits = fits && boxes[1].len == mesh[parsed].blocks * BLOCK * 72;
    }
    if (is_done && !(fits && out.len % 8 == 0 && (!named.obj || named.len == out.len) && fit(in, count, out.len / 8))) {
        PyErr_Format(PyExc_ValueError, "sizes of arrays do not fit together");
        is_done = 0;
    }
    if (is_done) {
        Shapes shapes = {in[1].len / (Py_ssize_t)sizeof(double), in[0].buf, in[1].buf, in[2].buf, in[3].buf,
                         in[4].buf, in[5].buf, mesh, NULL, {NULL, 0, 0}};
        Py_BEGIN_ALLOW_THREADS;
        is_done = cast_all(&shapes, in[7].len / (Py_ssize_t)sizeof(double), in[6].buf, in[7].buf, in[8].buf, in[9].buf,
                           in[10].buf, out.len / (Py_ssize_t)sizeof(double), in[11].buf, out.buf, named.buf);
        Py_END_ALLOW_THREADS;
        if (!is_done) PyErr_NoMemory();
    }
    for (Py_ssize_t i = 0; i < 2 * parsed; i++) PyBuffer_Release(held + i);
    for (int i = 0; i < 12; i++) PyBuffer_Release(in + i);
    PyBuffer_Release(&out);
    if (named.obj) PyBuffer_Release(&named);
    free(mesh), free(held);
    if (!is_done) return NULL;
    Py_RETURN_NONE;
}

/* turned(orientations, directions, ways): `shapes.rotated` of directions (count, rays, 3) by (4, count): (3, count, rays). */
static PyObject *turned(PyObject *Py_UNUSED(self), PyObject *arguments) {
    Py_buffer orientations, directions, ways;
    if (!PyArg_ParseTuple(arguments, "y*y*w*", &orientations, &directions, &ways)) return NULL;
    int64_t count = orientations.len / (Py_ssize_t)(4 * sizeof(double));
    int64_t all = directions.len / (Py_ssize_t)(3 * sizeof(double)), rays = count ? all / count : 0;
    const double *q = orientations.buf, *in = directions.buf;
    double *out = ways.buf;
    int fits = orientations.len == 32 * count && directions.len == 24 * all && ways.len == 24 * all && all == count * rays;
    for (int64_t n = 0; fits && n < count; n++) {
        double qx = q[n], qy = q[count + n], qz = q[2 * count + n], qw = q[3 * count + n];
        for (int64_t k = n * rays; k < (n + 1) * rays; k++) {
            double x = in[3 * k], y = in[3 * k + 1], z = in[3 * k + 2];
            double tx = 2.0 * (qy * z - qz * y), ty = 2.0 * (qz * x - qx * z), tz = 2.0 * (qx * y - qy * x);
            out[k] = x + qw * tx + (qy * tz - qz * ty);
            out[all + k] = y + qw * ty + (qz * tx - qx * tz);
            out[2 * all + k] = z + qw * tz + (qx * ty - qy * tx);
        }
    }
    PyBuffer_Release(&orientations), PyBuffer_Release(&directions), PyBuffer_Release(&ways);
    if (!fits) return PyErr_Format(PyExc_ValueError, "sizes of arrays do not fit together");
    Py_RETURN_NONE;
}
