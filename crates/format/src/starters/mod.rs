//! Scenes to start from: the one that `pliant new` writes, small, commented, runs as it is; of a mesh; of an
//! organ with vessels and capsule.

mod of_mesh;
mod organ_scene;

pub use of_mesh::{SceneOfMesh, is_mesh, scene_of_given, scene_of_mesh};
pub use organ_scene::OrganScene;

/// The text of a starter scene with a title.
pub fn starter(name: &str) -> String {
    // A TOML string: what a folder can be called may hold quotes.
    let title = serde_json::Value::from(name).to_string();
    include_str!("starter.toml").replace("\"TITLE\"", &title)
}
