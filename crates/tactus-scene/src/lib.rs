//! Scenes: meshes from files, made shapes, and their depth image under an orthographic camera.
