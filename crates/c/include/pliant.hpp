// Pliant for C++17: owning classes over pliant.h. Errors are exceptions with their place. The guide is docs/guide/c.md.
#ifndef PLIANT_HPP
#define PLIANT_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pliant.h"

namespace pliant {

using Vector = std::array<double, 3>;
// A unit quaternion x, y, z, w.
using Rotation = std::array<double, 4>;

// What went wrong, and where: line, column and key of a scene, or body, node, element and time of a simulation.
class Error : public std::runtime_error {
public:
    explicit Error(const PliantError &error)
        : std::runtime_error(error.message), status(error.status), mistakes(error.mistakes), line(error.line),
          column(error.column), node(error.node), element(error.element), time(error.time), kind(error.kind),
          body(error.body), key(error.key), file(error.file) {}

    PliantStatus status;
    std::uint32_t mistakes, line, column;
    std::int64_t node, element;
    double time;
    std::string kind, body, key, file;
};

namespace detail {

template <class Function, class... Arguments>
void call(Function function, Arguments... arguments) {
    PliantError error;
    if (function(arguments..., &error) != PLIANT_STATUS_OK) throw Error(error);
}

// How many triples of numbers there are.
inline std::size_t triples(const std::vector<double> &numbers, const char *name) {
    if (numbers.size() % 3 != 0) throw std::invalid_argument(std::string(name) + " are three numbers each");
    return numbers.size() / 3;
}

struct Close {
    void operator()(PliantContext *context) const { pliant_context_close(context); }
};

using Shared = std::shared_ptr<PliantContext>;
using Closer = PliantStatus (*)(const PliantContext *, std::uint64_t, PliantError *);

// A handle that is closed with its owner. It keeps the context.
template <Closer close>
class Handle {
public:
    Handle(Shared context, std::uint64_t id) : context_(std::move(context)), id_(id) {}
    Handle(Handle &&other) noexcept : context_(std::move(other.context_)), id_(std::exchange(other.id_, 0)) {}
    Handle &operator=(Handle &&other) noexcept {
        std::swap(context_, other.context_);
        std::swap(id_, other.id_);
        return *this;
    }
    Handle(const Handle &) = delete;
    Handle &operator=(const Handle &) = delete;
    ~Handle() {
        if (id_ != 0) close(context_.get(), id_, nullptr);
    }

    // For calls of pliant.h.
    const PliantContext *context() const { return context_.get(); }
    std::uint64_t id() const { return id_; }

protected:
    Shared context_;
    std::uint64_t id_;
};

inline PliantBuffer buffer(float *data, std::size_t count, std::size_t stride = 0) {
    return PliantBuffer{data, count, stride, PLIANT_F32};
}

inline PliantBuffer buffer(double *data, std::size_t count, std::size_t stride = 0) {
    return PliantBuffer{data, count, stride, PLIANT_F64};
}

}  // namespace detail

using Snapshot = detail::Handle<pliant_snapshot_close>;

// A tool or an obstacle at an instant: place [m], opening of its jaws [rad], force [N] and moment [N m] on it.
struct Tool {
    Vector position;
    Rotation rotation;
    double opening;
    Vector force, torque;
};

class Simulation;

// The surface of a body. It belongs to its simulation and must not outlive it.
class Surface {
public:
    std::size_t vertices() const { return surface_.vertices; }
    std::size_t triangles() const { return surface_.triangles; }

    // Three vertices a triangle, counter-clockwise seen from outside.
    std::vector<std::uint32_t> indices() const {
        std::vector<std::uint32_t> all(3 * triangles());
        detail::call(pliant_surface_triangles, context_, simulation_, surface_.number, all.data(), triangles());
        return all;
    }

    // Copies positions [m] or unit normals: three numbers a vertex.
    template <class Number>
    void positions(std::vector<Number> &to) const {
        to.resize(3 * vertices());
        positions(detail::buffer(to.data(), vertices()));
    }
    template <class Number>
    void normals(std::vector<Number> &to) const {
        to.resize(3 * vertices());
        normals(detail::buffer(to.data(), vertices()));
    }
    void positions(PliantBuffer to) const {
        detail::call(pliant_surface_positions, context_, simulation_, surface_.number, to);
    }
    void normals(PliantBuffer to) const {
        detail::call(pliant_surface_normals, context_, simulation_, surface_.number, to);
    }

    // Positions [m] and unit normals without a copy, three numbers a vertex: they stay as they are until they are lent again.
    std::pair<const double *, const double *> lend() const {
        std::pair<const double *, const double *> lent;
        detail::call(pliant_surface_lend, context_, simulation_, surface_.number, &lent.first, &lent.second);
        return lent;
    }

    std::uint32_t number() const { return surface_.number; }

private:
    friend class Simulation;
    Surface(const PliantContext *context, PliantSimulation simulation, PliantSurface surface)
        : context_(context), simulation_(simulation), surface_(surface) {}
    const PliantContext *context_;
    PliantSimulation simulation_;
    PliantSurface surface_;
};

class Simulation : public detail::Handle<pliant_simulation_close> {
public:
    using Handle::Handle;

    PliantNow now() const {
        PliantNow now{};
        detail::call(pliant_now, context(), id(), &now);
        return now;
    }
    double time() const { return now().time; }

    // How many steps were taken.
    std::uint64_t step(std::uint64_t count = 1) {
        std::uint64_t done = 0;
        detail::call(pliant_step, context(), id(), count, &done);
        return done;
    }
    std::uint64_t run_until(double time) {
        std::uint64_t done = 0;
        detail::call(pliant_run_until, context(), id(), time, &done);
        return done;
    }
    // From another thread: ends the steps under way.
    void stop() const { detail::call(pliant_stop, context(), id()); }

    // The surface of a body or one that it carries; without a name that of the only body.
    Surface surface(const std::string &name = "") const {
        PliantSurface surface{};
        detail::call(pliant_surface_open, context(), id(), name.empty() ? nullptr : name.c_str(), &surface);
        return Surface(context(), id(), surface);
    }

    // Values of nodes (PLIANT_POSITION, ...): three numbers a node; without a name those of all bodies.
    std::vector<double> nodes(std::uint32_t what, const std::string &body = "") const {
        const char *name = body.empty() ? nullptr : body.c_str();
        PliantNodes nodes{};
        detail::call(pliant_body, context(), id(), name, &nodes);
        std::vector<double> values(3 * nodes.count);
        detail::call(pliant_nodes, context(), id(), name, what, detail::buffer(values.data(), nodes.count));
        return values;
    }

    // A field of a body, at its points or its cells, and how many numbers an item has.
    std::pair<std::vector<double>, std::size_t> field(const std::string &name, const std::string &on = "",
                                                      std::uint32_t at = PLIANT_AT_POINTS) const {
        const char *body = on.empty() ? nullptr : on.c_str();
        std::size_t items = 0, components = 0;
        const PliantBuffer none = {nullptr, 0, 0, PLIANT_F64};
        detail::call(pliant_field, context(), id(), body, name.c_str(), at, none, &items, &components);
        std::vector<double> values(items * components);
        detail::call(pliant_field, context(), id(), body, name.c_str(), at, detail::buffer(values.data(), items), &items,
                     &components);
        return {std::move(values), components};
    }

    Vector reaction(const std::string &constraint) const {
        Vector force{};
        detail::call(pliant_reaction, context(), id(), constraint.c_str(), reinterpret_cast<double(*)[3]>(force.data()));
        return force;
    }
    Vector contact_force(const std::string &contact) const {
        Vector force{};
        detail::call(pliant_contact_force, context(), id(), contact.c_str(), reinterpret_cast<double(*)[3]>(force.data()));
        return force;
    }
    PliantEnergies energies() const {
        PliantEnergies energies{};
        detail::call(pliant_energies, context(), id(), &energies);
        return energies;
    }

    // The same bits of the motion have the same one.
    std::uint64_t fingerprint() const {
        std::uint64_t fingerprint = 0;
        detail::call(pliant_fingerprint, context(), id(), &fingerprint);
        return fingerprint;
    }

    // Names of a kind (PLIANT_BODIES, ...).
    std::vector<std::string> names(std::uint32_t kind) const {
        std::vector<std::string> all;
        PliantError error;
        std::size_t length = 0;
        while (pliant_name(context(), id(), kind, all.size(), nullptr, 0, &length, &error) == PLIANT_STATUS_OK) {
            std::vector<char> name(length + 1);
            detail::call(pliant_name, context(), id(), kind, all.size(), name.data(), name.size(), nullptr);
            all.emplace_back(name.data());
        }
        if (error.status != PLIANT_STATUS_UNKNOWN) throw Error(error);
        return all;
    }

    // Leads a tool to a pose within a time [s]; when it is there [s].
    double lead(const std::string &tool, const Vector &position, const Rotation &rotation, double within) {
        double arrival = 0;
        detail::call(pliant_tool_lead, context(), id(), tool.c_str(), position.data(), rotation.data(), within, &arrival);
        return arrival;
    }
    // Leads a tool to a pose and its jaws to an angle [rad] at the same time.
    double lead(const std::string &tool, const Vector &position, const Rotation &rotation, double angle, double within) {
        double arrival = 0.0;
        detail::call(pliant_tool_lead_open, context(), id(), tool.c_str(), position.data(), rotation.data(), angle, within, &arrival);
        return arrival;
    }
    double open(const std::string &tool, double angle, double within) {
        double arrival = 0;
        detail::call(pliant_tool_open, context(), id(), tool.c_str(), angle, within, &arrival);
        return arrival;
    }
    Tool tool(const std::string &name) const {
        PliantTool now{};
        detail::call(pliant_tool, context(), id(), name.c_str(), &now);
        Tool tool{};
        for (int c = 0; c < 3; c++) {
            tool.position[c] = now.position[c];
            tool.force[c] = now.force[c];
            tool.torque[c] = now.torque[c];
        }
        for (int c = 0; c < 4; c++) tool.rotation[c] = now.rotation[c];
        tool.opening = now.opening;
        return tool;
    }

    // Hands and pins: the number of a grip for the calls below.
    std::uint32_t grip(const Surface &surface, const Vector &point, double radius, double stiffness) {
        std::uint32_t grip = 0;
        detail::call(pliant_grip_surface, context(), id(), surface.number(), point.data(), radius, stiffness, &grip);
        return grip;
    }
    // By their mean.
    std::uint32_t grip(const std::vector<std::uint32_t> &nodes, double stiffness) {
        std::uint32_t grip = 0;
        detail::call(pliant_grip_nodes, context(), id(), nodes.data(), nullptr, nodes.size(), stiffness, &grip);
        return grip;
    }
    void move(std::uint32_t grip, const Vector &place) {
        detail::call(pliant_grip_move, context(), id(), grip, place.data());
    }
    PliantGrip grip(std::uint32_t grip) const {
        PliantGrip now{};
        detail::call(pliant_grip, context(), id(), grip, &now);
        return now;
    }
    void release(std::uint32_t grip) { detail::call(pliant_grip_release, context(), id(), grip); }

    // Forces [N] on all nodes, three numbers a node, until they are replaced; none ends them.
    void push(const std::vector<double> &forces) {
        detail::call(pliant_push, context(), id(), forces.data(), detail::triples(forces, "forces"));
    }

    Snapshot snapshot() const {
        PliantSnapshot snapshot = 0;
        detail::call(pliant_snapshot_take, context(), id(), &snapshot);
        return Snapshot(context_, snapshot);
    }
    Snapshot snapshot(const std::vector<std::uint8_t> &bytes) const {
        PliantSnapshot snapshot = 0;
        detail::call(pliant_snapshot_read, context(), id(), bytes.data(), bytes.size(), &snapshot);
        return Snapshot(context_, snapshot);
    }
    void restore(const Snapshot &snapshot) { detail::call(pliant_snapshot_restore, context(), id(), snapshot.id()); }
};

// A snapshot as bytes.
inline std::vector<std::uint8_t> bytes(const Snapshot &snapshot) {
    std::size_t length = 0;
    detail::call(pliant_snapshot_bytes, snapshot.context(), snapshot.id(), nullptr, std::size_t{0}, &length);
    std::vector<std::uint8_t> all(length);
    detail::call(pliant_snapshot_bytes, snapshot.context(), snapshot.id(), all.data(), all.size(), &length);
    return all;
}

class Scene : public detail::Handle<pliant_scene_close> {
public:
    using Handle::Handle;

    // As `--set` does: "law.tissue.young-modulus=4e3".
    void set(const std::string &assignment) { detail::call(pliant_scene_set, context(), id(), assignment.c_str()); }

    // A mesh from memory: bodies take it with `mesh = { given = "NAME" }`. Three numbers [m] a point.
    void give_mesh(const std::string &name, const std::vector<double> &points, const std::vector<PliantCells> &cells) {
        detail::call(pliant_scene_give_mesh, context(), id(), name.c_str(), points.data(), detail::triples(points, "points"), cells.data(),
                     cells.size());
    }

    // On so many threads of its own; 0 takes `threads` of the scene.
    Simulation simulate(std::uint32_t threads = 0) const {
        PliantSimulation simulation = 0;
        detail::call(pliant_simulation_open, context(), id(), threads, &simulation);
        return Simulation(context_, simulation);
    }
};

// All that a program has open. Scenes, simulations and snapshots keep it.
class Context {
public:
    Context() {
        PliantContext *context = nullptr;
        detail::call(pliant_context_open, static_cast<std::uint32_t>(PLIANT_ABI), &context);
        context_ = detail::Shared(context, detail::Close());
    }

    // A scene file, or a folder with a scene.toml.
    Scene load(const std::string &path) const {
        PliantScene scene = 0;
        detail::call(pliant_scene_load, context(), path.c_str(), &scene);
        return Scene(context_, scene);
    }
    // A scene's text; files that it names are in `folder`.
    Scene parse(const std::string &text, const std::string &folder = ".", const std::string &name = "scene.toml") const {
        PliantScene scene = 0;
        detail::call(pliant_scene_parse, context(), text.data(), text.size(), folder.c_str(), name.c_str(), &scene);
        return Scene(context_, scene);
    }

    const PliantContext *context() const { return context_.get(); }

private:
    detail::Shared context_;
};

}  // namespace pliant

#endif
