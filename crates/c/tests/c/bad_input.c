/* Every bad input of a C caller is answered by its code; nothing crashes, and what was open goes on. Run by tests/embed.rs. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pliant.h"

static const char *BLOCK =
    "[scene]\n"
    "until = 100\n"
    "gravity = [0, 0, -9.81]\n"
    "[law.tissue]\n"
    "type = 'neo-hookean'\n"
    "young-modulus = 10e3\n"
    "poisson-ratio = 0.45\n"
    "[body.block]\n"
    "mesh = { block = { size = [0.1, 0.05, 0.05] }, edge = 0.025, as = 'tets' }\n"
    "law = 'tissue'\n"
    "density = 1000\n"
    "damping = 20\n"
    "[constraint.wall]\n"
    "type = 'fix'\n"
    "body = 'block'\n"
    "nodes = { set = 'x-min' }\n"
    "[tool.ball]\n"
    "shape = { sphere = { radius = 0.01 } }\n"
    "at = [0.05, 0.025, 0.07]\n"
    "[contact.press]\n"
    "between = ['block', 'ball']\n";

static PliantError error;
static int failures;

/* The call has this status, and its error says so, with a message that has a word. */
#define EXPECT(call, wanted, word)                                                                          \
    do {                                                                                                    \
        memset(&error, 0x55, sizeof error);                                                                 \
        PliantStatus status = (call);                                                                       \
        if (status != (wanted) || error.status != status || (status && !strstr(error.message, (word)))) {   \
            printf("line %d: status %d, not %d: %s\n", __LINE__, (int)status, (int)(wanted), status ? error.message : ""); \
            failures++;                                                                                     \
        }                                                                                                   \
    } while (0)
#define TRUE(what)                                                  \
    do {                                                            \
        if (!(what)) {                                              \
            printf("line %d: not so: %s\n", __LINE__, #what);       \
            failures++;                                             \
        }                                                           \
    } while (0)
#define OK(call) EXPECT(call, PLIANT_STATUS_OK, "")

static PliantContext *context;
static PliantSimulation simulation;

static void *long_run(void *result) {
    PliantStatus status;
    /* The other thread may look just now. */
    do status = pliant_run_until(context, simulation, 90.0, NULL, NULL);
    while (status == PLIANT_STATUS_BUSY);
    *(PliantStatus *)result = status;
    return NULL;
}

struct job {
    PliantSimulation simulation;
    PliantStatus status;
    uint64_t print;
};

static void *side_by_side(void *argument) {
    struct job *job = argument;
    job->status = pliant_step(context, job->simulation, 500, NULL, NULL);
    if (job->status == PLIANT_STATUS_OK) job->status = pliant_fingerprint(context, job->simulation, &job->print, NULL);
    return NULL;
}

int main(void) {
    PliantScene scene = 0, other = 0;
    PliantSnapshot snapshot = 0;
    const double nan3[3] = {0, NAN, 0}, still[4] = {0, 0, 0, 1}, zero4[4] = {0, 0, 0, 0}, up[3] = {0.05, 0.025, 0.066};
    uint64_t done = 0;
    double three[3];

    /* Contexts. */
    TRUE(pliant_abi() == PLIANT_ABI && pliant_version()[0] == '0');
    EXPECT(pliant_context_open(PLIANT_ABI + 1, &context, &error), PLIANT_STATUS_VERSION, "version 2");
    EXPECT(pliant_context_open(PLIANT_ABI, NULL, &error), PLIANT_STATUS_NULL, "`context`");
    OK(pliant_context_open(PLIANT_ABI, &context, &error));
    EXPECT(pliant_scene_load(NULL, "x", &scene, &error), PLIANT_STATUS_NULL, "context");
    TRUE(pliant_scene_load(NULL, "x", &scene, NULL) == PLIANT_STATUS_NULL);
    pliant_context_close(NULL);

    /* Scenes. */
    EXPECT(pliant_scene_load(context, NULL, &scene, &error), PLIANT_STATUS_NULL, "`path`");
    EXPECT(pliant_scene_load(context, "no/such/scene.toml", &scene, &error), PLIANT_STATUS_FILE, "no/such");
    TRUE(!strcmp(error.file, "no/such/scene.toml"));
    EXPECT(pliant_scene_load(context, "\xff\xfe", &scene, &error), PLIANT_STATUS_NOT_TEXT, "UTF-8");
    EXPECT(pliant_scene_parse(context, "\xff", 1, NULL, NULL, &scene, &error), PLIANT_STATUS_NOT_TEXT, "UTF-8");
    EXPECT(pliant_scene_parse(context, NULL, 5, NULL, NULL, &scene, &error), PLIANT_STATUS_NULL, "`text`");
    EXPECT(pliant_scene_parse(context, BLOCK, (size_t)1 << 40, NULL, NULL, &scene, &error), PLIANT_STATUS_SCENE, "bytes");
    EXPECT(pliant_scene_parse(context, "[scene\n", 7, NULL, "mine.toml", &scene, &error), PLIANT_STATUS_SCENE, "");
    TRUE(error.line == 1 && !strcmp(error.file, "mine.toml") && error.mistakes == 1);
    char *huge = malloc(100000000);
    if (!huge) return 1;
    memset(huge, '#', 100000000);
    EXPECT(pliant_scene_parse(context, huge, 100000000, NULL, NULL, &scene, &error), PLIANT_STATUS_SCENE, "100000000 bytes");
    free(huge);
    OK(pliant_scene_parse(context, BLOCK, strlen(BLOCK), NULL, NULL, &scene, &error));
    EXPECT(pliant_scene_set(context, scene, NULL, &error), PLIANT_STATUS_NULL, "`assignment`");
    EXPECT(pliant_scene_set(context, scene, "no value", &error), PLIANT_STATUS_SCENE, "");
    EXPECT(pliant_scene_set(context, 0, "a.b=1", &error), PLIANT_STATUS_BAD_HANDLE, "no handle");
    EXPECT(pliant_scene_set(context, ~scene, "a.b=1", &error), PLIANT_STATUS_BAD_HANDLE, "no handle");

    /* Mistakes of values are reported when a simulation is made, with their place. */
    char *wrong = strdup(BLOCK);
    memcpy(strstr(wrong, "10e3"), "-1e3", 4);
    OK(pliant_scene_parse(context, wrong, strlen(wrong), NULL, "wrong.toml", &other, &error));
    free(wrong);
    EXPECT(pliant_simulation_open(context, other, 1, &simulation, &error), PLIANT_STATUS_SCENE, "young-modulus");
    TRUE(error.line == 6 && error.column == 17 && !strcmp(error.key, "law.tissue.young-modulus"));
    OK(pliant_scene_close(context, other, &error));
    EXPECT(pliant_simulation_open(context, other, 1, &simulation, &error), PLIANT_STATUS_CLOSED, "closed");
    EXPECT(pliant_simulation_open(context, scene, 1, NULL, &error), PLIANT_STATUS_NULL, "`simulation`");
    EXPECT(pliant_simulation_open(context, scene, 1025, &simulation, &error), PLIANT_STATUS_UNSUPPORTED, "at most 1024");

    /* Meshes from memory. */
    const double corners[] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
    const uint32_t tet[] = {0, 1, 2, 3}, outside[] = {0, 1, 2, 4};
    PliantCells cells = {PLIANT_TETS, 1, tet, NULL}, twice[2] = {cells, cells};
    OK(pliant_scene_parse(context, BLOCK, strlen(BLOCK), NULL, NULL, &other, &error));
    EXPECT(pliant_scene_give_mesh(context, other, NULL, corners, 4, &cells, 1, &error), PLIANT_STATUS_NULL, "`name`");
    EXPECT(pliant_scene_give_mesh(context, other, "mine", NULL, 4, &cells, 1, &error), PLIANT_STATUS_NULL, "`points`");
    EXPECT(pliant_scene_give_mesh(context, other, "mine", nan3, 1, &cells, 1, &error), PLIANT_STATUS_NOT_A_NUMBER, "`points`");
    EXPECT(pliant_scene_give_mesh(context, other, "mine", corners, SIZE_MAX / 2, &cells, 1, &error), PLIANT_STATUS_SHORT_BUFFER, "too many");
    EXPECT(pliant_scene_give_mesh(context, other, "mine", corners, 4, twice, 2, &error), PLIANT_STATUS_BAD_CELLS, "twice");
    cells.nodes = outside;
    EXPECT(pliant_scene_give_mesh(context, other, "mine", corners, 4, &cells, 1, &error), PLIANT_STATUS_BAD_CELLS, "cell 0 has the node 4");
    cells.nodes = NULL;
    EXPECT(pliant_scene_give_mesh(context, other, "mine", corners, 4, &cells, 1, &error), PLIANT_STATUS_NULL, "`nodes`");
    cells.kind = 99;
    EXPECT(pliant_scene_give_mesh(context, other, "mine", corners, 4, &cells, 1, &error), PLIANT_STATUS_BAD_CELLS, "kind 99");
    OK(pliant_scene_give_mesh(context, other, "mine", corners, 4, twice, 1, &error));
    OK(pliant_scene_set(context, other, "body.block.mesh={ given = 'mine' }", &error));
    OK(pliant_scene_set(context, other, "constraint.wall.nodes={ half-space = { point = [0, 0, 0.01], normal = [0, 0, -1] } }", &error));
    OK(pliant_simulation_open(context, other, 1, &simulation, &error));
    PliantNodes body;
    EXPECT(pliant_body(context, simulation, "blok", &body, &error), PLIANT_STATUS_UNKNOWN, "there are block");
    OK(pliant_body(context, simulation, "block", &body, &error));
    TRUE(body.first == 0 && body.count == 4);
    OK(pliant_step(context, simulation, 5, NULL, &error));
    OK(pliant_simulation_close(context, simulation, &error));
    OK(pliant_scene_close(context, other, &error));

    /* Simulations. */
    OK(pliant_simulation_open(context, scene, 1, &simulation, &error));
    EXPECT(pliant_step(context, scene, 1, &done, &error), PLIANT_STATUS_BAD_HANDLE, "of a scene");
    EXPECT(pliant_scene_set(context, simulation, "a.b=1", &error), PLIANT_STATUS_BAD_HANDLE, "of a simulation");
    OK(pliant_step(context, simulation, 3, &done, &error));
    TRUE(done == 3);
    OK(pliant_step(context, simulation, 0, NULL, &error));
    EXPECT(pliant_run_until(context, simulation, NAN, &done, &error), PLIANT_STATUS_NOT_A_NUMBER, "`time`");
    EXPECT(pliant_run_until(context, simulation, INFINITY, &done, &error), PLIANT_STATUS_NOT_A_NUMBER, "`time`");
    OK(pliant_run_until(context, simulation, -1.0, &done, &error));
    TRUE(done == 0);
    EXPECT(pliant_now(context, simulation, NULL, &error), PLIANT_STATUS_NULL, "`now`");
    PliantNow now;
    OK(pliant_now(context, simulation, &now, &error));
    TRUE(now.steps == 3 && now.time > 0 && now.step > 0 && now.nodes > 0);

    /* Surfaces and buffers. */
    PliantSurface skin;
    EXPECT(pliant_surface_open(context, simulation, "blok", &skin, &error), PLIANT_STATUS_UNKNOWN, "there are block");
    OK(pliant_surface_open(context, simulation, NULL, &skin, &error));
    double *numbers = malloc(9 * sizeof *numbers * now.nodes);
    uint32_t *triangles = malloc(3 * sizeof *triangles * skin.triangles);
    if (!numbers || !triangles) return 1;
    PliantBuffer good = {numbers, skin.vertices, 0, PLIANT_F64}, bad = good;
    OK(pliant_surface_positions(context, simulation, skin.number, good, &error));
    bad.count--;
    EXPECT(pliant_surface_positions(context, simulation, skin.number, bad, &error), PLIANT_STATUS_SHORT_BUFFER, "needed");
    bad = good, bad.stride = 8;
    EXPECT(pliant_surface_normals(context, simulation, skin.number, bad, &error), PLIANT_STATUS_SHORT_BUFFER, "stride");
    bad = good, bad.stride = SIZE_MAX / 2;
    EXPECT(pliant_surface_positions(context, simulation, skin.number, bad, &error), PLIANT_STATUS_SHORT_BUFFER, "stride");
    bad = good, bad.numbers = 7;
    EXPECT(pliant_surface_positions(context, simulation, skin.number, bad, &error), PLIANT_STATUS_NOT_A_NUMBER, "PLIANT_F32");
    bad = good, bad.data = NULL;
    EXPECT(pliant_surface_positions(context, simulation, skin.number, bad, &error), PLIANT_STATUS_NULL, "`data`");
    EXPECT(pliant_surface_positions(context, simulation, 9, good, &error), PLIANT_STATUS_BAD_HANDLE, "no surface 9");
    EXPECT(pliant_surface_triangles(context, simulation, skin.number, triangles, 1, &error), PLIANT_STATUS_SHORT_BUFFER, "room for 1");
    EXPECT(pliant_surface_triangles(context, simulation, skin.number, NULL, 9999, &error), PLIANT_STATUS_NULL, "`triangles`");
    OK(pliant_surface_triangles(context, simulation, skin.number, triangles, skin.triangles, &error));
    const double *lent, *normals;
    EXPECT(pliant_surface_lend(context, simulation, skin.number, NULL, NULL, &error), PLIANT_STATUS_NULL, "`positions`");
    OK(pliant_surface_lend(context, simulation, skin.number, &lent, &normals, &error));
    TRUE(!memcmp(lent, numbers, 3 * sizeof *numbers * skin.vertices));

    /* Nodes, fields and names. */
    EXPECT(pliant_nodes(context, simulation, NULL, 9, good, &error), PLIANT_STATUS_NOT_A_NUMBER, "kind 9");
    EXPECT(pliant_nodes(context, simulation, "blok", PLIANT_REST, good, &error), PLIANT_STATUS_UNKNOWN, "`blok`");
    bad = good, bad.count = now.nodes;
    OK(pliant_nodes(context, simulation, NULL, PLIANT_VELOCITY, bad, &error));
    size_t items, components;
    EXPECT(pliant_field(context, simulation, NULL, "von-mieses", PLIANT_AT_POINTS, good, &items, &components, &error), PLIANT_STATUS_UNKNOWN, "von-mises");
    EXPECT(pliant_field(context, simulation, "blok", "von-mises", PLIANT_AT_POINTS, good, &items, &components, &error), PLIANT_STATUS_UNKNOWN, "blok");
    EXPECT(pliant_field(context, simulation, NULL, "bending-moment", PLIANT_AT_POINTS, good, &items, &components, &error), PLIANT_STATUS_UNKNOWN, "bending-moment");
    EXPECT(pliant_field(context, simulation, NULL, "von-mises", 5, good, &items, &components, &error), PLIANT_STATUS_NOT_A_NUMBER, "`at` is 5");
    PliantBuffer none = {NULL, 0, 0, PLIANT_F64};
    OK(pliant_field(context, simulation, NULL, "cauchy-stress", PLIANT_AT_POINTS, none, &items, &components, &error));
    TRUE(items == now.nodes && components == 9);
    OK(pliant_field(context, simulation, NULL, "cauchy-stress", PLIANT_AT_POINTS, bad, NULL, NULL, &error));
    bad.count = 3;
    EXPECT(pliant_field(context, simulation, NULL, "von-mises", PLIANT_AT_CELLS, bad, &items, &components, &error), PLIANT_STATUS_SHORT_BUFFER, "room for 3");
    char name[16];
    size_t length;
    EXPECT(pliant_name(context, simulation, PLIANT_TOOLS, 1, name, sizeof name, &length, &error), PLIANT_STATUS_UNKNOWN, "1 of this kind");
    EXPECT(pliant_name(context, simulation, PLIANT_TOOLS, 0, name, 4, &length, &error), PLIANT_STATUS_SHORT_BUFFER, "5 are needed");
    EXPECT(pliant_name(context, simulation, 99, 0, name, sizeof name, &length, &error), PLIANT_STATUS_NOT_A_NUMBER, "kind 99");
    OK(pliant_name(context, simulation, PLIANT_TOOLS, 0, name, sizeof name, &length, &error));
    TRUE(length == 4 && !strcmp(name, "ball"));
    EXPECT(pliant_reaction(context, simulation, "wal", &three, &error), PLIANT_STATUS_UNKNOWN, "there are wall");
    EXPECT(pliant_reaction(context, simulation, "wall", NULL, &error), PLIANT_STATUS_NULL, "`force`");
    OK(pliant_reaction(context, simulation, "wall", &three, &error));
    EXPECT(pliant_contact_force(context, simulation, "pres", &three, &error), PLIANT_STATUS_UNKNOWN, "there are press");
    OK(pliant_contact_force(context, simulation, "press", &three, &error));
    EXPECT(pliant_energies(context, simulation, NULL, &error), PLIANT_STATUS_NULL, "`energies`");

    /* Tools, hands, forces. */
    EXPECT(pliant_tool_lead(context, simulation, "bal", up, still, 0.1, NULL, &error), PLIANT_STATUS_UNKNOWN, "there are ball");
    EXPECT(pliant_tool_lead(context, simulation, "ball", nan3, still, 0.1, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "`position`");
    EXPECT(pliant_tool_lead(context, simulation, "ball", up, zero4, 0.1, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "length 0");
    EXPECT(pliant_tool_lead(context, simulation, "ball", NULL, still, 0.1, NULL, &error), PLIANT_STATUS_NULL, "`position`");
    EXPECT(pliant_tool_lead(context, simulation, "ball", up, still, INFINITY, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "`within`");
    EXPECT(pliant_tool_open(context, simulation, "ball", NAN, 0.1, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "angle");
    /* Longer than all numbers, and no turn all the same. */
    const double long4[] = {0, 0, 0, 1e200};
    OK(pliant_tool_lead(context, simulation, "ball", up, long4, 0.1, NULL, &error));
    OK(pliant_tool_lead(context, simulation, "ball", up, still, 0.1, &three[0], &error));
    EXPECT(pliant_tool_lead_open(context, simulation, "ball", up, still, NAN, 0.1, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "angle");
    EXPECT(pliant_tool_lead_open(context, simulation, "ball", up, zero4, 0.2, 0.1, NULL, &error), PLIANT_STATUS_NOT_A_NUMBER, "length 0");
    EXPECT(pliant_tool_lead_open(context, simulation, "bal", up, still, 0.2, 0.1, NULL, &error), PLIANT_STATUS_UNKNOWN, "there are ball");
    OK(pliant_tool_lead_open(context, simulation, "ball", up, still, 0.2, 0.1, &three[0], &error));
    TRUE(three[0] >= 0.1);
    PliantTool tool;
    EXPECT(pliant_tool(context, simulation, "bal", &tool, &error), PLIANT_STATUS_UNKNOWN, "ball");
    OK(pliant_tool(context, simulation, "ball", &tool, &error));
    const uint32_t far = 1u << 30, first = 0;
    const double negative = -1;
    uint32_t grip;
    EXPECT(pliant_grip_nodes(context, simulation, &far, NULL, 1, 10, &grip, &error), PLIANT_STATUS_UNKNOWN, "at least one node");
    EXPECT(pliant_grip_nodes(context, simulation, NULL, NULL, 1, 10, &grip, &error), PLIANT_STATUS_NULL, "`nodes`");
    EXPECT(pliant_grip_nodes(context, simulation, &first, NULL, 0, 10, &grip, &error), PLIANT_STATUS_UNKNOWN, "at least one node");
    EXPECT(pliant_grip_nodes(context, simulation, &first, &negative, 1, 10, &grip, &error), PLIANT_STATUS_NOT_A_NUMBER, "weights");
    EXPECT(pliant_grip_nodes(context, simulation, &first, NULL, 1, -10, &grip, &error), PLIANT_STATUS_NOT_A_NUMBER, "`stiffness`");
    EXPECT(pliant_grip_surface(context, simulation, skin.number, nan3, 0.01, 10, &grip, &error), PLIANT_STATUS_NOT_A_NUMBER, "`point`");
    EXPECT(pliant_grip_surface(context, simulation, skin.number, up, -0.01, 10, &grip, &error), PLIANT_STATUS_NOT_A_NUMBER, "`radius`");
    const uint32_t pair[] = {0, 1};
    const double heavy[] = {1e308, 1e308};
    EXPECT(pliant_grip_nodes(context, simulation, pair, heavy, 2, 10, &grip, &error), PLIANT_STATUS_NOT_A_NUMBER, "finite");
    OK(pliant_grip_surface(context, simulation, skin.number, up, 0.03, INFINITY, &grip, &error));
    EXPECT(pliant_grip_move(context, simulation, grip, nan3, &error), PLIANT_STATUS_NOT_A_NUMBER, "`place`");
    EXPECT(pliant_grip_move(context, simulation, grip + 1, up, &error), PLIANT_STATUS_BAD_HANDLE, "no grip 1");
    OK(pliant_grip_release(context, simulation, grip, &error));
    EXPECT(pliant_grip_release(context, simulation, grip, &error), PLIANT_STATUS_CLOSED, "released");
    EXPECT(pliant_push(context, simulation, three, 1, &error), PLIANT_STATUS_SHORT_BUFFER, "are needed");
    EXPECT(pliant_push(context, simulation, NULL, now.nodes, &error), PLIANT_STATUS_NULL, "`forces`");
    for (size_t at = 0; at < 3 * now.nodes; at++) numbers[at] = NAN;
    EXPECT(pliant_push(context, simulation, numbers, now.nodes, &error), PLIANT_STATUS_NOT_A_NUMBER, "`forces`");
    OK(pliant_push(context, simulation, NULL, 0, &error));

    /* Snapshots. */
    EXPECT(pliant_snapshot_take(context, simulation, NULL, &error), PLIANT_STATUS_NULL, "`snapshot`");
    OK(pliant_snapshot_take(context, simulation, &snapshot, &error));
    EXPECT(pliant_snapshot_restore(context, simulation, simulation, &error), PLIANT_STATUS_BAD_HANDLE, "of a simulation");
    OK(pliant_snapshot_bytes(context, snapshot, NULL, 0, &length, &error));
    uint8_t *bytes = malloc(length);
    if (!bytes) return 1;
    EXPECT(pliant_snapshot_bytes(context, snapshot, bytes, length - 1, NULL, &error), PLIANT_STATUS_SHORT_BUFFER, "are needed");
    OK(pliant_snapshot_bytes(context, snapshot, bytes, length, NULL, &error));
    PliantSnapshot read;
    EXPECT(pliant_snapshot_read(context, simulation, bytes, length - 1, &read, &error), PLIANT_STATUS_BAD_SNAPSHOT, "bytes instead");
    EXPECT(pliant_snapshot_read(context, simulation, bytes, 3, &read, &error), PLIANT_STATUS_BAD_SNAPSHOT, "no snapshot header");
    EXPECT(pliant_snapshot_read(context, simulation, NULL, 3, &read, &error), PLIANT_STATUS_NULL, "`bytes`");
    bytes[length / 2] ^= 1;
    EXPECT(pliant_snapshot_read(context, simulation, bytes, length, &read, &error), PLIANT_STATUS_BAD_SNAPSHOT, "damaged");
    bytes[length / 2] ^= 1;
    OK(pliant_snapshot_read(context, simulation, bytes, length, &read, &error));
    uint64_t prints[2];
    OK(pliant_step(context, simulation, 50, NULL, &error));
    OK(pliant_fingerprint(context, simulation, &prints[0], &error));
    OK(pliant_snapshot_restore(context, simulation, read, &error));
    OK(pliant_step(context, simulation, 50, NULL, &error));
    OK(pliant_fingerprint(context, simulation, &prints[1], &error));
    TRUE(prints[0] == prints[1]);
    PliantSimulation stiffer;
    OK(pliant_scene_set(context, scene, "law.tissue.young-modulus=20e3", &error));
    OK(pliant_simulation_open(context, scene, 1, &stiffer, &error));
    EXPECT(pliant_snapshot_restore(context, stiffer, snapshot, &error), PLIANT_STATUS_BAD_SNAPSHOT, "another model");
    OK(pliant_simulation_close(context, stiffer, &error));
    OK(pliant_snapshot_close(context, read, &error));
    OK(pliant_snapshot_close(context, snapshot, &error));
    EXPECT(pliant_snapshot_close(context, snapshot, &error), PLIANT_STATUS_CLOSED, "closed");
    free(bytes);

    /* A second thread finds that the first one steps, and stops it. */
    pthread_t thread;
    PliantStatus status = PLIANT_STATUS_OK;
    if (pthread_create(&thread, NULL, long_run, &status)) return 1;
    while (pliant_now(context, simulation, &now, &error) != PLIANT_STATUS_BUSY) {
    }
    EXPECT(pliant_step(context, simulation, 1, &done, &error), PLIANT_STATUS_BUSY, "another thread");
    TRUE(done == 0);
    OK(pliant_stop(context, simulation, &error));
    pthread_join(thread, NULL);
    TRUE(status == PLIANT_STATUS_STOPPED);
    OK(pliant_step(context, simulation, 1, &done, &error));

    /* Two simulations run side by side, to the same bits. */
    struct job jobs[2];
    pthread_t threads[2];
    for (int at = 0; at < 2; at++) {
        OK(pliant_simulation_open(context, scene, at + 1, &jobs[at].simulation, &error));
        if (pthread_create(&threads[at], NULL, side_by_side, &jobs[at])) return 1;
    }
    for (int at = 0; at < 2; at++) {
        pthread_join(threads[at], NULL);
        TRUE(jobs[at].status == PLIANT_STATUS_OK && jobs[at].print == jobs[0].print);
        OK(pliant_simulation_close(context, jobs[at].simulation, &error));
    }

    /* A simulation that fails tells where; it stays at the last good instant. */
    for (size_t at = 0; at < 3 * now.nodes; at++) numbers[at] = at == 3 * now.nodes - 1 ? -1e6 : 0;
    OK(pliant_push(context, simulation, numbers, now.nodes, &error));
    EXPECT(pliant_step(context, simulation, 100000, &done, &error), PLIANT_STATUS_FAILED, "block");
    TRUE(error.time > 0 && error.kind[0] && !strcmp(error.body, "block") && done < 100000);
    OK(pliant_now(context, simulation, &now, &error));

    OK(pliant_simulation_close(context, simulation, &error));
    EXPECT(pliant_simulation_close(context, simulation, &error), PLIANT_STATUS_CLOSED, "closed");
    EXPECT(pliant_step(context, simulation, 1, &done, &error), PLIANT_STATUS_CLOSED, "closed");
    OK(pliant_scene_close(context, scene, &error));
    free(triangles);
    free(numbers);
    pliant_context_close(context);
    if (failures) printf("%d failures\n", failures);
    else printf("all as expected\n");
    return failures ? 1 : 0;
}
