/* 6: a loop at 60 Hz with a tool that presses the liver, in C. The finger goes down as a hand would lead it; positions go into a vertex buffer,
 * and its force is printed.
 *
 * Run: cargo build --release -p pliant-c
 *      cc examples/6_embed/press.c -I crates/c/include -L target/release -lpliant_c -Wl,-rpath,target/release -o target/press
 *      target/press scenes/palpation
 *
 * Read before: 1 and docs/guide/c.md. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "pliant.h"

/* A vertex as a renderer has it: the library writes into it with a stride. */
struct vertex {
    float position[3];
    float normal[3];
};

static PliantError error;

static void check(PliantStatus status) {
    if (status != PLIANT_STATUS_OK) {
        fprintf(stderr, "%s:%u:%u %s: %s\n", error.file, error.line, error.column, error.key, error.message);
        exit(1);
    }
}

int main(int count, char **arguments) {
    const char *path = count > 1 ? arguments[1] : "scenes/palpation";
    const int frames = count > 2 ? atoi(arguments[2]) : 60;

    PliantContext *context;
    check(pliant_context_open(PLIANT_ABI, &context, &error));
    PliantScene scene;
    check(pliant_scene_load(context, path, &scene, &error));
    /* As with `--set`: half as stiff as in the file. */
    check(pliant_scene_set(context, scene, "law.parenchyma.shear-modulus=1.5e3", &error));
    PliantSimulation simulation;
    check(pliant_simulation_open(context, scene, 0, &simulation, &error));

    PliantSurface skin;
    check(pliant_surface_open(context, simulation, "liver", &skin, &error));
    struct vertex *vertices = malloc(skin.vertices * sizeof *vertices);
    uint32_t *triangles = malloc(3 * skin.triangles * sizeof *triangles);
    if (!vertices || !triangles) return 1;
    check(pliant_surface_triangles(context, simulation, skin.number, triangles, skin.triangles, &error));
    const PliantBuffer positions = {vertices->position, skin.vertices, sizeof *vertices, PLIANT_F32};
    const PliantBuffer normals = {vertices->normal, skin.vertices, sizeof *vertices, PLIANT_F32};

    PliantTool finger;
    check(pliant_tool(context, simulation, "finger", &finger, &error));
    double place[3] = {finger.position[0], finger.position[1], finger.position[2]};
    for (int frame = 1; frame <= frames; frame++) {
        /* What a tracker would tell: 60 mm/s down. A device gives its pose here. */
        place[2] -= 0.06 / 60;
        check(pliant_tool_lead(context, simulation, "finger", place, finger.rotation, 1.0 / 60, NULL, &error));
        check(pliant_run_until(context, simulation, frame / 60.0, NULL, &error));
        check(pliant_surface_positions(context, simulation, skin.number, positions, &error));
        check(pliant_surface_normals(context, simulation, skin.number, normals, &error));
        if (frame % 10 == 0) {
            PliantTool now;
            check(pliant_tool(context, simulation, "finger", &now, &error));
            printf("t = %.3f s: the finger feels %.3f N\n", frame / 60.0, now.force[2]);
        }
    }

    free(triangles);
    free(vertices);
    pliant_context_close(context);
    return 0;
}
