// 6: a loop at 60 Hz with a tool that presses the liver, in C++.
//
// Run: cargo build --release -p pliant-c
//      c++ -std=c++17 examples/6_embed/press.cpp -I crates/c/include -L target/release -lpliant_c -Wl,-rpath,target/release -o target/press
//      target/press scenes/palpation
//
// Read before: press.c.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "pliant.hpp"

int main(int count, char **arguments) {
    const char *path = count > 1 ? arguments[1] : "scenes/palpation";
    const int frames = count > 2 ? std::atoi(arguments[2]) : 60;
    try {
        pliant::Context context;
        pliant::Scene scene = context.load(path);
        scene.set("law.parenchyma.shear-modulus=1.5e3");
        pliant::Simulation simulation = scene.simulate();
        pliant::Surface skin = simulation.surface("liver");
        std::vector<float> positions(3 * skin.vertices());
        const pliant::Snapshot start = simulation.snapshot();

        const pliant::Tool first = simulation.tool("finger");
        pliant::Vector place = first.position;
        for (int frame = 1; frame <= frames; frame++) {
            place[2] -= 0.06 / 60;
            simulation.lead("finger", place, first.rotation, 1.0 / 60);
            simulation.run_until(frame / 60.0);
            skin.positions(positions);
            if (frame % 10 == 0)
                std::printf("t = %.3f s: the finger feels %.3f N\n", simulation.time(), simulation.tool("finger").force[2]);
        }
        // Back to where it began, as a trainer does.
        simulation.restore(start);
    } catch (const pliant::Error &error) {
        std::fprintf(stderr, "%s:%u:%u %s: %s\n", error.file.c_str(), error.line, error.column, error.key.c_str(), error.what());
        return 1;
    }
    return 0;
}
