//! A scene whose explicit steps are too long once it is pressed.

/// Returns the scene of a cube of 10 mm. The cube is pressed gently, then by 6 mm in all between 3 s and
/// `until` [s]. Cells invert within steps of 1 ms.
pub fn pressed_cube(until: f64) -> String {
    format!(
        r#"[scene]
until = 4.0
[run]
precision = "double"
step = 1e-3
checkpoint = {{ every = 0.5 }}
[law.a]
type = "neo-hookean"
young-modulus = 1e4
poisson-ratio = 0.3
[body.b]
mesh = {{ block = {{ size = [0.01, 0.01, 0.01], cells = [2, 2, 2] }}, as = "hexes" }}
element = "hex8-full"
law = "a"
density = 1000
damping = 20
[constraint.low]
type = "fix"
body = "b"
nodes = {{ set = "z-min" }}
[constraint.top]
type = "move"
body = "b"
nodes = {{ set = "z-max" }}
by = [0, 0, -0.006]
curve = {{ table = [[0, 0], [1, 0.01], [3, 0.01], [{until}, 1], [4, 1]] }}
[output.history]
type = "csv"
every = 0.01
[output.fields]
type = "vtu"
every = 0.05
data = ["displacement"]
"#
    )
}
