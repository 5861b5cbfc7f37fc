/* Pliant: real-time simulation of soft organs, for C and C++. The guide is docs/guide/c.md.
 * Made from crates/c/src by crates/c/tests/header.rs. */
#ifndef PLIANT_H
#define PLIANT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* All that a program has open. */
typedef struct PliantContext PliantContext;

/* Result of a call. */
typedef enum PliantStatus {
    /* The call succeeded. */
    PLIANT_STATUS_OK = 0,
    /* A pointer is null that must not be. */
    PLIANT_STATUS_NULL = 1,
    /* A text is not UTF-8. */
    PLIANT_STATUS_NOT_TEXT = 2,
    /* A number is not finite, or out of its range. */
    PLIANT_STATUS_NOT_A_NUMBER = 3,
    /* A buffer is too short; the message says for how many items. */
    PLIANT_STATUS_SHORT_BUFFER = 4,
    /* A handle was never given out by this context, or is of another kind. */
    PLIANT_STATUS_BAD_HANDLE = 5,
    /* A handle was closed: by `..._close`, or by a panic. */
    PLIANT_STATUS_CLOSED = 6,
    /* Another thread has a call on this handle under way. Nothing happened. */
    PLIANT_STATUS_BUSY = 7,
    /* There is nothing of this name. */
    PLIANT_STATUS_UNKNOWN = 8,
    /* The scene has mistakes; line, column and key locate the first one. */
    PLIANT_STATUS_SCENE = 9,
    /* A file can't be read. */
    PLIANT_STATUS_FILE = 10,
    /* The simulation failed; kind, body, node, element and time locate the failure. */
    PLIANT_STATUS_FAILED = 11,
    /* The solver or the device can't do this. */
    PLIANT_STATUS_UNSUPPORTED = 12,
    /* Another thread asked to stop; the steps taken so far stay. */
    PLIANT_STATUS_STOPPED = 13,
    /* The program was built for another version of this interface. */
    PLIANT_STATUS_VERSION = 14,
    /* A cell names a node that does not exist, or has an unknown type. */
    PLIANT_STATUS_BAD_CELLS = 15,
    /* A snapshot is damaged, or of another model. */
    PLIANT_STATUS_BAD_SNAPSHOT = 16,
    /* A defect of Pliant. The handle is closed. */
    PLIANT_STATUS_INTERNAL = 17,
} PliantStatus;

/* An error and its place. The caller owns it; it holds no memory of the library. Texts are UTF-8, end with a
 * zero and are cut where they are longer. */
typedef struct PliantError {
    /* The code that the call returned. */
    PliantStatus status;
    /* Mistakes of the scene in all; 0 of other errors. */
    uint32_t mistakes;
    /* Line and column in the scene, from 1, the column in characters; 0 if there is no such place. */
    uint32_t line;
    /* See `line`. */
    uint32_t column;
    /* The node of `body`, from 0; -1 if it is about none. */
    int64_t node;
    /* The element of `body`, from 0; -1 if it is about none. */
    int64_t element;
    /* Time [s] of the simulation; NaN if it is about none. */
    double time;
    /* Kind of a `PLIANT_STATUS_FAILED`: `not-finite`, `inverted`, `unbalanced`, `unstable`, `singular`,
     * `not-converged`, `blocked`, `intersecting`, `hourglass`, `device`, `output` or `input`. */
    char kind[32];
    /* The body that it is about. */
    char body[64];
    /* The key of the scene, such as `law.tissue.young-modulus`. */
    char key[256];
    /* The scene file, as it was given. */
    char file[512];
    /* The mistake, and a remedy. */
    char message[2048];
} PliantError;

/* The version of this interface: a program passes `PLIANT_ABI` of the header that it was built with to
 * `pliant_context_open`. It grows where a change breaks programs. */
#define PLIANT_ABI 1

/* The version of the interface that this library has. */
uint32_t pliant_abi(void);

/* The version of Pliant, such as `0.1.0`. It lives as long as the process. */
const char *pliant_version(void);

/* Opens a context: all that a program opens is in one. `abi` is `PLIANT_ABI`. Contexts know nothing of each
 * other. */
PliantStatus pliant_context_open(uint32_t abi, PliantContext **context, PliantError *error);

/* Closes a context with all that is open in it. No call on it may be under way, and none may come after;
 * null does nothing. */
void pliant_context_close(PliantContext *context);

/* A scene that is open: a number that `pliant_scene_load` or `pliant_scene_parse` gives, never 0. */
typedef uint64_t PliantScene;

/* Cells of a mesh of the program are lines of two nodes. */
#define PLIANT_LINES 3

/* Cells are triangles. */
#define PLIANT_TRIANGLES 5

/* Cells are quadrilaterals. */
#define PLIANT_QUADS 9

/* Cells are tetrahedra. */
#define PLIANT_TETS 10

/* Cells are hexahedra. */
#define PLIANT_HEXES 12

/* Cells of one kind, numbered as in VTK. The library copies them. */
typedef struct PliantCells {
    /* `PLIANT_TETS` or another kind, with the numbers of VTK. */
    uint32_t kind;
    /* Number of cells. */
    size_t count;
    /* Nodes of all cells, cell after cell, counted from 0. */
    const uint32_t *nodes;
    /* A label for each cell, or null. */
    const int32_t *labels;
} PliantCells;

/* Opens a scene: the path of a scene file, or of a folder with a `scene.toml`. A simulation that is made of
 * it reports mistakes in its values. */
PliantStatus pliant_scene_load(const PliantContext *context, const char *path, PliantScene *scene, PliantError *error);

/* Opens a scene from its text of `length` bytes. Files that it names are relative to `folder`; null is the
 * folder of the process. `name` is the name of the text in errors; null is `scene.toml`. */
PliantStatus pliant_scene_parse(const PliantContext *context, const char *scene_text, size_t length, const char *folder, const char *name, PliantScene *scene, PliantError *error);

/* Changes a value of a scene, as `--set` does: `law.tissue.young-modulus=4e3`, `scene.until=2`,
 * `run.precision="single"`. */
PliantStatus pliant_scene_set(const PliantContext *context, PliantScene scene, const char *assignment, PliantError *error);

/* Gives a scene a mesh from memory: bodies take it with `mesh = { given = "NAME" }`. `points` has three
 * numbers [m] a point. Nodes without a cell are a mistake that the simulation reports when it is made. A
 * mesh of the same name takes its place. */
PliantStatus pliant_scene_give_mesh(const PliantContext *context, PliantScene scene, const char *name, const double *points, size_t point_count, const PliantCells *cells, size_t kinds, PliantError *error);

/* Closes a scene. Simulations that were made of it stay. */
PliantStatus pliant_scene_close(const PliantContext *context, PliantScene scene, PliantError *error);

/* A simulation that is open: a number that `pliant_simulation_open` gives, never 0. */
typedef uint64_t PliantSimulation;

/* Makes a simulation of a scene as it is now, at its start. It computes on threads of its own, 1024 at most;
 * with 0 it takes `threads` of the scene's `[run]`. Results do not depend on their number. Images are meshed
 * and shapes built here: this can take seconds. */
PliantStatus pliant_simulation_open(const PliantContext *context, PliantScene scene, uint32_t threads, PliantSimulation *simulation, PliantError *error);

/* Closes a simulation. One that is stepped by another thread is stopped first; its memory goes when that
 * call returns. */
PliantStatus pliant_simulation_close(const PliantContext *context, PliantSimulation simulation, PliantError *error);

/* Time, step and sizes of a simulation. */
typedef struct PliantNow {
    /* Time [s]. */
    double time;
    /* Length [s] of the next step. */
    double step;
    /* Steps since the start. */
    uint64_t steps;
    /* Nodes of all bodies. */
    uint64_t nodes;
} PliantNow;

/* Reports time, step and sizes of a simulation. */
PliantStatus pliant_now(const PliantContext *context, PliantSimulation simulation, PliantNow *now, PliantError *error);

/* Takes `count` steps. `done`, if it is not null, gets the number of steps taken, also after a failure or a
 * stop from another thread. After a failure the simulation stands at the last good instant; restore a
 * snapshot, or close it. */
PliantStatus pliant_step(const PliantContext *context, PliantSimulation simulation, uint64_t count, uint64_t *done, PliantError *error);

/* Steps to the instant nearest to a time [s], like `pliant_step`. A time that has passed takes no step. */
PliantStatus pliant_run_until(const PliantContext *context, PliantSimulation simulation, double time, uint64_t *done, PliantError *error);

/* Asks the thread that steps a simulation to stop after its step. A step that takes long is abandoned, and
 * the simulation stays at the instant before. Without such a thread, the next call that steps returns at
 * once. Any thread may ask. */
PliantStatus pliant_stop(const PliantContext *context, PliantSimulation simulation, PliantError *error);

/* Pushes nodes with forces [N], three numbers a node, in the order of `pliant_body`, until they are
 * replaced; their work is external. `count` is the number of nodes of all bodies, or 0 to end all. */
PliantStatus pliant_push(const PliantContext *context, PliantSimulation simulation, const double *forces, size_t count, PliantError *error);

/* Bodies, as the kind of a name. */
#define PLIANT_BODIES 0

/* Surfaces that bodies carry. */
#define PLIANT_SURFACES 1

/* Constraints. */
#define PLIANT_CONSTRAINTS 2

/* Contacts. */
#define PLIANT_CONTACTS 3

/* Tools and obstacles. */
#define PLIANT_TOOLS 4

/* Warnings about the scene, a sentence each. */
#define PLIANT_WARNINGS 5

/* Gives the name of a thing of a kind (`PLIANT_BODIES`, …) by its number from 0, with a zero at its end;
 * `PLIANT_STATUS_UNKNOWN` after the last. `length`, if it is not null, gets the bytes without the zero; with
 * a null buffer of 0 bytes nothing else is given. */
PliantStatus pliant_name(const PliantContext *context, PliantSimulation simulation, uint32_t kind, size_t index, char *buffer, size_t capacity, size_t *length, PliantError *error);

/* Numbers are `float`. */
#define PLIANT_F32 0

/* Numbers are `double`. */
#define PLIANT_F64 1

/* Memory of the caller for items of one or more numbers, such as the positions in a vertex buffer. */
typedef struct PliantBuffer {
    /* The first number of the first item. It need not be aligned. */
    void *data;
    /* Items that there is room for. */
    size_t count;
    /* Bytes from an item to the next one; 0 if they follow each other. */
    size_t stride;
    /* `PLIANT_F32` or `PLIANT_F64`. */
    uint32_t numbers;
} PliantBuffer;

/* Sizes of a surface. */
typedef struct PliantSurface {
    /* Its number in the simulation, for the calls below. */
    uint32_t number;
    /* Its vertices. */
    uint32_t vertices;
    /* Its triangles. */
    uint32_t triangles;
} PliantSurface;

/* Opens the boundary of a body, or a surface that one carries, by name; null is the only body. Of a solid
 * only nodes on the boundary are vertices. It stays open as long as the simulation. */
PliantStatus pliant_surface_open(const PliantContext *context, PliantSimulation simulation, const char *name, PliantSurface *surface, PliantError *error);

/* Copies the three vertices of each triangle, counter-clockwise seen from outside. `capacity` is the number
 * of triangles that there is room for. */
PliantStatus pliant_surface_triangles(const PliantContext *context, PliantSimulation simulation, uint32_t surface, uint32_t *triangles, size_t capacity, PliantError *error);

/* Copies where the vertices are [m]. */
PliantStatus pliant_surface_positions(const PliantContext *context, PliantSimulation simulation, uint32_t surface, PliantBuffer buffer, PliantError *error);

/* Copies the unit normals of the vertices: the mean of the normals of the triangles around each, by area. */
PliantStatus pliant_surface_normals(const PliantContext *context, PliantSimulation simulation, uint32_t surface, PliantBuffer buffer, PliantError *error);

/* Lends positions [m] and unit normals, three `double` a vertex. The values stay the same until the next
 * call of this function for this surface. The memory stays until the simulation is closed, and the pointers
 * stay the same. `normals` may be null, which saves their cost. */
PliantStatus pliant_surface_lend(const PliantContext *context, PliantSimulation simulation, uint32_t surface, const double **positions, const double **normals, PliantError *error);

/* The nodes of a body: `count` nodes from the first one on, counted over all bodies. */
typedef struct PliantNodes {
    /* The first one. */
    uint64_t first;
    /* Number of nodes. */
    uint64_t count;
} PliantNodes;

/* Reports the nodes of a body by name; null is all bodies. They are numbered as in its mesh file or in the
 * given mesh, unless repairs changed the numbers. A wall on a solid has only nodes of its own here. */
PliantStatus pliant_body(const PliantContext *context, PliantSimulation simulation, const char *body, PliantNodes *found, PliantError *error);

/* Positions of nodes [m]. */
#define PLIANT_POSITION 0

/* Displacements of nodes [m]. */
#define PLIANT_DISPLACEMENT 1

/* Velocities of nodes [m/s]. */
#define PLIANT_VELOCITY 2

/* Positions of nodes at rest [m]. */
#define PLIANT_REST 3

/* Copies positions, displacements, velocities (`PLIANT_POSITION`, …) of the nodes of a body by name; null is
 * all bodies. */
PliantStatus pliant_nodes(const PliantContext *context, PliantSimulation simulation, const char *body, uint32_t what, PliantBuffer buffer, PliantError *error);

/* Fields are read at the points of a body's mesh: fields of elements are means of the elements around each
 * point. */
#define PLIANT_AT_POINTS 0

/* Fields are read in the elements, as computed. */
#define PLIANT_AT_CELLS 1

/* Copies a field, such as `von-mises`, of a body or a surface that one carries, by name; null is the only
 * body. Fields have the names, units and components of `data` in the scene. `items` and `components`, if not
 * null, get how many items there are, and numbers in each; with a null buffer nothing else is given. A field
 * that a body does not have is NaN there. */
PliantStatus pliant_field(const PliantContext *context, PliantSimulation simulation, const char *on, const char *name, uint32_t at, PliantBuffer buffer, size_t *items, size_t *components, PliantError *error);

/* Gives the force [N] by which a constraint holds or moves its nodes. */
PliantStatus pliant_reaction(const PliantContext *context, PliantSimulation simulation, const char *constraint, double (*force)[3], PliantError *error);

/* Gives the force [N] of a contact with an obstacle or a tool on this; of two bodies, on the second one. */
PliantStatus pliant_contact_force(const PliantContext *context, PliantSimulation simulation, const char *contact, double (*force)[3], PliantError *error);

/* Energies of all bodies [J]. */
typedef struct PliantEnergies {
    /* Energy of motion. */
    double kinetic;
    /* Stored in elements, and taken by laws that relax. */
    double internal;
    /* Taken by damping. */
    double damping;
    /* Energy of the stiffness against hourglass modes, in addition to `internal`. */
    double hourglass;
    /* Work from outside. */
    double external;
    /* Energy added by explicit steps of changing length. */
    double step_changes;
    /* Error of the energy balance over the largest energy so far: above 0.05 a run is questionable. */
    double balance;
} PliantEnergies;

/* Gives the energies. */
PliantStatus pliant_energies(const PliantContext *context, PliantSimulation simulation, PliantEnergies *energies, PliantError *error);

/* Gives a fingerprint of the motion: the same bits have the same one. */
PliantStatus pliant_fingerprint(const PliantContext *context, PliantSimulation simulation, uint64_t *fingerprint, PliantError *error);

/* A tool or an obstacle at an instant. */
typedef struct PliantTool {
    /* Origin of its frame [m]. */
    double position[3];
    /* Rotation of its frame: a unit quaternion x, y, z, w. */
    double rotation[4];
    /* The angle [rad] between its jaws; 0 without any. */
    double opening;
    /* The force [N] on it of all that touches it. */
    double force[3];
    /* The moment [N m] of these forces about its frame; NaN on a GPU. */
    double torque[3];
} PliantTool;

/* Leads a tool to a pose within a time [s] from now, on a straight way and the shortest turn; there it
 * stays. The motion of its jaws continues. `rotation` is a quaternion x, y, z, w of any length but 0.
 * `arrival`, if it is not null, gets the time [s] of arrival. That time is later than asked for if the tool
 * would pass over nodes on the way. */
PliantStatus pliant_tool_lead(const PliantContext *context, PliantSimulation simulation, const char *tool, const double *position, const double *rotation, double within, double *arrival, PliantError *error);

/* Opens or closes the jaws of a tool to an angle [rad] within a time [s] from now. The motion of the tool
 * continues. `arrival` is as in `pliant_tool_lead`. */
PliantStatus pliant_tool_open(const PliantContext *context, PliantSimulation simulation, const char *tool, double angle, double within, double *arrival, PliantError *error);

/* Leads a tool to a pose and its jaws to an angle [rad], so that both arrive together. The other arguments
 * are as in `pliant_tool_lead`. */
PliantStatus pliant_tool_lead_open(const PliantContext *context, PliantSimulation simulation, const char *tool, const double *position, const double *rotation, double angle, double within, double *arrival, PliantError *error);

/* Reports the pose of a tool, an obstacle or a jaw (`grasper.upper`, `grasper.lower`), and the forces on it. */
PliantStatus pliant_tool(const PliantContext *context, PliantSimulation simulation, const char *tool, PliantTool *now, PliantError *error);

/* Takes hold of nodes by a spring of a stiffness [N/m]; infinite is a pin. It acts on their mean by
 * `weights`, which need not sum to 1; null weighs all the same. The stiffness is at most the one with which
 * steps stay stable; `pliant_grip` reports it. `grip` gets the number of the grip. The grip pulls nothing
 * until it is moved. */
PliantStatus pliant_grip_nodes(const PliantContext *context, PliantSimulation simulation, const uint32_t *nodes, const double *weights, size_t count, double stiffness, uint32_t *grip, PliantError *error);

/* Takes hold of a surface around its vertex that is nearest to a point [m], as a hand does. The grip holds
 * the connected surface within a radius [m] of that vertex at rest, less with the distance. With a radius of
 * 0 it holds the vertex alone. Stiffness and number are as in `pliant_grip_nodes`. */
PliantStatus pliant_grip_surface(const PliantContext *context, PliantSimulation simulation, uint32_t surface, const double *point, double radius, double stiffness, uint32_t *grip, PliantError *error);

/* Moves a grip to a place [m]: it pulls its nodes there from the next step on. */
PliantStatus pliant_grip_move(const PliantContext *context, PliantSimulation simulation, uint32_t grip, const double *place, PliantError *error);

/* A grip at an instant. */
typedef struct PliantGrip {
    /* Mean place of its nodes [m]. */
    double point[3];
    /* Place to which the grip pulls [m]. */
    double place[3];
    /* Its force on the body [N]. */
    double force[3];
    /* Its stiffness [N/m]. */
    double stiffness;
} PliantGrip;

/* Reports the pull of a grip. */
PliantStatus pliant_grip(const PliantContext *context, PliantSimulation simulation, uint32_t grip, PliantGrip *now, PliantError *error);

/* Releases a grip. */
PliantStatus pliant_grip_release(const PliantContext *context, PliantSimulation simulation, uint32_t grip, PliantError *error);

/* A snapshot that is open: a number that `pliant_snapshot_take` gives, never 0. */
typedef uint64_t PliantSnapshot;

/* Keeps the state of a simulation, at any instant. Nothing that follows is changed by it. */
PliantStatus pliant_snapshot_take(const PliantContext *context, PliantSimulation simulation, PliantSnapshot *snapshot, PliantError *error);

/* Takes a simulation back, or on, to a snapshot: of itself, or of another simulation of the same scene. What
 * follows has the same bits as it had. Grips and forces of the program stay. */
PliantStatus pliant_snapshot_restore(const PliantContext *context, PliantSimulation simulation, PliantSnapshot snapshot, PliantError *error);

/* Copies a snapshot as bytes, for a file or another process. `length`, if it is not null, gets how many
 * there are; with a null buffer of 0 bytes nothing else is given. */
PliantStatus pliant_snapshot_bytes(const PliantContext *context, PliantSnapshot snapshot, uint8_t *buffer, size_t capacity, size_t *length, PliantError *error);

/* Reads a snapshot of a simulation of the same scene from bytes. Other and damaged snapshots give
 * `PLIANT_STATUS_BAD_SNAPSHOT`. */
PliantStatus pliant_snapshot_read(const PliantContext *context, PliantSimulation simulation, const uint8_t *bytes, size_t count, PliantSnapshot *snapshot, PliantError *error);

/* Closes a snapshot. */
PliantStatus pliant_snapshot_close(const PliantContext *context, PliantSnapshot snapshot, PliantError *error);

#ifdef __cplusplus
}
#endif

#endif
