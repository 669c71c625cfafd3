/* Drives a robot along the x axis to a place, over the socket of a gateway: reads its pose, writes its speeds.
 *
 *     cc -o drive drive.c
 *     ./drive 127.0.0.1 4000 cat.pose cat.motion 2.0
 */
#define _POSIX_C_SOURCE 200809L
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

static int dial(const char *host, const char *port)
{
    struct addrinfo want = {.ai_socktype = SOCK_STREAM}, *found;
    int wire = -1;
    if (getaddrinfo(host, port, &want, &found) == 0) {
        wire = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
        if (wire < 0 || connect(wire, found->ai_addr, found->ai_addrlen) < 0) {
            fprintf(stderr, "nothing listens at %s:%s\n", host, port);
            exit(1);
        }
        freeaddrinfo(found);
    }
    return wire;
}

/* Ask the service of the simulator for the port of a component's stream, and connect to it. */
static int dial_stream(const char *host, int services, FILE *answers, const char *component)
{
    char answer[256], port[16];
    dprintf(services, "1 simulation get_stream_port [\"%s\"]\n", component);
    if (!fgets(answer, sizeof answer, answers) || sscanf(answer, "1 SUCCESS %15[0-9]", port) != 1) {
        fprintf(stderr, "%s has no stream: %s", component, answer);
        exit(1);
    }
    return dial(host, port);
}

/* The number of a field in a line of JSON; 0 without it. */
static double field(const char *line, const char *name)
{
    char key[32];
    snprintf(key, sizeof key, "\"%s\": ", name);
    const char *at = strstr(line, key);
    return at ? strtod(at + strlen(key), NULL) : 0.0;
}

int main(int count, char **words)
{
    if (count != 6) {
        fprintf(stderr, "usage: drive HOST PORT POSE MOTION X\n");
        return 2;
    }
    int services = dial(words[1], words[2]);
    FILE *answers = fdopen(services, "r");
    FILE *poses = fdopen(dial_stream(words[1], services, answers, words[3]), "r");
    int motion = dial_stream(words[1], services, answers, words[4]);
    char line[1024];
    while (fgets(line, sizeof line, poses)) {
        double left = strtod(words[5], NULL) - field(line, "x");
        double turn = -2.0 * field(line, "yaw") - field(line, "y");
        dprintf(motion, "{\"v\": %f, \"w\": %f}\n", left > 0.0 ? 1.0 : 0.0, left > 0.0 ? turn : 0.0);
        if (left <= 0.0)
            return 0;
    }
    fprintf(stderr, "the run has ended before\n");
    return 1;
}
