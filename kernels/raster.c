/* The nearest triangle at each pixel: `raster` in raster.py is the same in numpy, bit for bit.

Corners go through a matrix of 4 rows to x, y, w, z: the pixel is (x / w, y / w) with rows downwards, the nearness z / w.
Pixels are integers of 1/256 from there on: which centres a triangle covers has no rounding, and two that share an edge
leave no gap. The nearness is a plane over the triangle, rounded to float; the lower number wins among equals. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#define GUARD 1048576.0 /* Pixels about the picture beyond which triangles are clipped: products stay below 2^63. */
#define CLIPPED 20 /* Corners: a plane makes 4, 6, 9, 13, 19 of 3 at most, where rounding bends the edges of a sliver. */

typedef struct { double x, y, w, z; } Corner;
typedef struct { int64_t width, first, end; float *nearness; int32_t *numbers; } Band;

static int64_t floor_div(int64_t a, int64_t b) { int64_t q = a / b; return a % b < 0 ? q - 1 : q; } /* b > 0 */
static int64_t least(int64_t a, int64_t b) { return a < b ? a : b; }
static int64_t most(int64_t a, int64_t b) { return a > b ? a : b; }

static void fill(const Band *band, const int64_t x[3], const int64_t y[3], const double near[3], int both, int32_t number) {
    int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    int one = 1, two = 2;
    if (area == 0 || (area > 0 && !both)) return; /* Seen from outside, corners go round to the left. */
    if (area < 0) { area = -area; one = 2; two = 1; }
    const int64_t cx[3] = {x[0], x[one], x[two]}, cy[3] = {y[0], y[one], y[two]};
    int64_t left = most((least(least(cx[0], cx[1]), cx[2]) + 127) >> 8, 0);
    int64_t right = least((most(most(cx[0], cx[1]), cx[2]) - 128) >> 8, band->width - 1);
    int64_t top = most((least(least(cy[0], cy[1]), cy[2]) + 127) >> 8, band->first);
    int64_t bottom = least((most(most(cy[0], cy[1]), cy[2]) - 128) >> 8, band->end - 1);
    if (left > right || top > bottom) return;
    double inverse = 1.0 / (double)area, z0 = near[0], z1 = near[one] - z0, z2 = near[two] - z0;
    double ax = (double)(cx[1] - cx[0]), ay = (double)(cy[1] - cy[0]);
    double bx = (double)(cx[2] - cx[0]), by = (double)(cy[2] - cy[0]);
    double slope_x = (z1 * by - z2 * ay) * inverse * 256.0, slope_y = (z2 * ax - z1 * bx) * inverse * 256.0;
    double from_x = (double)cx[0] / 256.0 - 0.5, from_y = (double)cy[0] / 256.0 - 0.5;
    int64_t a[3], b[3], c[3]; /* Inside of edge i is a x + b y + c >= 0. */
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        int64_t da = cy[i] - cy[j], db = cx[j] - cx[i];
        int owns = da > 0 || (da == 0 && db > 0); /* A centre on an edge belongs to the triangle right of it or below. */
        a[i] = 256 * da, b[i] = 256 * db;
        c[i] = 128 * (da + db) - da * cx[i] - db * cy[i] - !owns;
    }
    for (int64_t row = top; row <= bottom; row++) {
        int64_t from = left, to = right;
        for (int i = 0; i < 3; i++) {
            int64_t edge = b[i] * row + c[i];
            if (a[i] > 0) from = most(from, -floor_div(edge, a[i]));
            else if (a[i] < 0) to = least(to, floor_div(edge, -a[i]));
            else if (edge < 0) to = -1;
        }
        float *nearness = band->nearness + row * band->width;
        int32_t *numbers = band->numbers + row * band->width;
        double base = z0 + slope_y * ((double)row - from_y);
        for (int64_t column = from; column <= to; column++) {
            float z = (float)(base + slope_x * ((double)column - from_x));
            if (z > nearness[column] || (z == nearness[column] && number < numbers[column]))
                nearness[column] = z, numbers[column] = number;
        }
    }
}

static double inside(const Corner *p, int plane, double near) {
    if (plane == 0) return p->w - near;
    double far = GUARD * p->w, at = plane < 3 ? p->x : p->y;
    return plane % 2 ? far + at : far - at;
}

/* Clip by near and guard planes, always from the corner inside: neighbours meet in equal bits. */
static int clip(Corner *polygon, double near) {
    Corner kept[CLIPPED];
    int count = 3;
    for (int plane = 0; plane < 5; plane++) {
        int n = 0;
        for (int i = 0; i < count; i++) {
            const Corner *p = polygon + i, *q = polygon + (i + 1) % count;
            double dp = inside(p, plane, near), dq = inside(q, plane, near);
            if (dp >= 0.0) kept[n++] = *p;
            if ((dp >= 0.0) == (dq >= 0.0)) continue;
            if (dp < 0.0) { const Corner *r = p; p = q; q = r; double d = dp; dp = dq; dq = d; }
            double k = dp / (dp - dq);
            kept[n++] = (Corner){p->x + (q->x - p->x) * k, p->y + (q->y - p->y) * k, p->w + (q->w - p->w) * k,
                                 p->z + (q->z - p->z) * k};
        }
        count = n;
        for (int i = 0; i < count; i++) polygon[i] = kept[i];
    }
    return count;
}

static void draw(const Band *band, double height, double near, const Corner *all, const int32_t *corners, int both,
                 int32_t number) {
    Corner p[CLIPPED];
    double width = (double)band->width;
    int is_plain = 1, count = 3, low = 15, right = 1, below = 1;
    for (int i = 0; i < 3; i++) {
        p[i] = all[corners[i]];
        double guard = GUARD * p[i].w;
        is_plain &= p[i].w >= near && p[i].x >= -guard && p[i].x <= guard && p[i].y >= -guard && p[i].y <= guard;
        low &= (p[i].w < near) | (p[i].x < 0.0) << 1 | (p[i].y < 0.0) << 2;
        right &= p[i].x > width * p[i].w, below &= p[i].y > height * p[i].w;
    }
    if (low || right || below) return;
    if (!is_plain) count = clip(p, near);
    int64_t x[CLIPPED], y[CLIPPED];
    double nearness[CLIPPED];
    for (int i = 0; i < count; i++) {
        double d = 1.0 / p[i].w;
        x[i] = (int64_t)floor(p[i].x * d * 256.0 + 0.5), y[i] = (int64_t)floor(p[i].y * d * 256.0 + 0.5);
        nearness[i] = p[i].z * d;
    }
    for (int i = 1; i + 1 < count; i++)
        fill(band, (int64_t[]){x[0], x[i], x[i + 1]}, (int64_t[]){y[0], y[i], y[i + 1]},
             (double[]){nearness[0], nearness[i], nearness[i + 1]}, both, number);
}

static PyObject *raster(PyObject *Py_UNUSED(self), PyObject *args) {
    Py_buffer world, triangles, ranges, matrix, nearness, numbers;
    double near;
    Py_ssize_t width, height, first, end;
    if (!PyArg_ParseTuple(args, "y*y*y*y*dnnnnw*w*", &world, &triangles, &ranges, &matrix, &near, &width, &height,
                          &first, &end, &nearness, &numbers))
        return NULL;
    const double *v = world.buf, *m = matrix.buf;
    const int32_t *t = triangles.buf, *range = ranges.buf;
    Py_ssize_t bytes = width * height * 4; /* Each triangle has corners of its model: they are not counted. */
    int fits = matrix.len == 128 && first >= 0 && end <= height && ranges.len % 20 == 0 && nearness.len == bytes &&
               numbers.len == bytes;
    for (Py_ssize_t k = 0; k < ranges.len / 20; k++) {
        const int32_t *run = range + 5 * k;
        fits = fits && run[0] >= 0 && run[1] <= world.len / 24 && run[2] >= 0 && run[3] <= triangles.len / 12;
    }
    Corner *all = fits ? malloc((size_t)(world.len / 24 + 1) * sizeof(Corner)) : NULL;
    if (all) {
        Py_BEGIN_ALLOW_THREADS
        Band band = {width, first, end, nearness.buf, numbers.buf};
        for (Py_ssize_t k = 0; k < ranges.len / 20; k++, range += 5) {
            for (int32_t i = range[0]; i < range[1]; i++) {
                double x = v[3 * i], y = v[3 * i + 1], z = v[3 * i + 2];
                all[i].x = m[0] * x + m[1] * y + m[2] * z + m[3], all[i].y = m[4] * x + m[5] * y + m[6] * z + m[7];
                all[i].w = m[8] * x + m[9] * y + m[10] * z + m[11], all[i].z = m[12] * x + m[13] * y + m[14] * z + m[15];
            }
            for (int32_t i = range[2]; i < range[3]; i++) draw(&band, (double)height, near, all, t + 3 * i, range[4], i);
        }
        Py_END_ALLOW_THREADS
    }
    free(all);
    PyBuffer_Release(&world), PyBuffer_Release(&triangles), PyBuffer_Release(&ranges), PyBuffer_Release(&matrix);
    PyBuffer_Release(&nearness), PyBuffer_Release(&numbers);
    if (!fits) return PyErr_Format(PyExc_ValueError, "sizes of arrays do not fit together");
    if (!all) return PyErr_NoMemory();
    Py_RETURN_NONE;
}
