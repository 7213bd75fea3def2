use super::*;

fn mesh() -> Indenter {
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.1], [1.0, 1.0 / 3.0, 0.0], [1.0, 1.0, -0.25]];
    Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [2, 1, 3]]).unwrap()))
}

#[test]
fn every_shape_reads_back_from_toml_and_json_to_the_bit() {
    for tool in [
        Indenter::Cylinder { diameter_mm: 0.1 + 0.2 },
        Indenter::Sphere { diameter_mm: 4.1 },
        Indenter::Cone { diameter_mm: 4.1, apex_deg: 200.0 / 3.0 },
        Indenter::Box { size_mm: [1.0, 2.0] },
        mesh(),
    ] {
        let raw = RawIndenter::of(&tool);
        let toml: RawIndenter = toml::from_str(&toml::to_string(&raw).unwrap()).unwrap();
        let json: RawIndenter = serde_json::from_str(&serde_json::to_string(&raw).unwrap()).unwrap();
        assert_eq!(toml.check("tool").unwrap(), tool);
        assert_eq!(json.check("tool").unwrap(), tool);
    }
}

#[test]
fn what_no_tool_has_is_refused_with_its_field() {
    let cone = |apex_deg: &str| format!("shape = 'cone'\ndiameter_mm = 1.0\napex_deg = {apex_deg}");
    let mesh = |vertices: &str, triangles: &str| {
        format!("shape = 'mesh'\nvertices_mm = {vertices}\ntriangles = {triangles}")
    };
    let corners = "[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]";
    for (text, error) in [
        (cone("0.0"), "tool.apex_deg: the full angle at the tip lies between 0 and 180"),
        (cone("180.0"), "tool.apex_deg: "),
        (cone("-60.0"), "tool.apex_deg: "),
        (cone("nan"), "tool.apex_deg: "),
        (cone("60.0\nsize_mm = [1.0, 1.0]"), "tool.shape: this shape has a diameter_mm and an apex_deg and"),
        (
            "shape = 'cone'\ndiameter_mm = 1.0".into(),
            "tool.shape: this shape has a diameter_mm and an apex_deg",
        ),
        ("shape = 'sphere'\ndiameter_mm = inf".into(), "tool.diameter_mm: positive and finite, not inf"),
        ("shape = 'box'\nsize_mm = [1.0, 0.0]".into(), "tool.size_mm[1]: positive"),
        (mesh(corners, "[[0, 1, 3]]"), "tool.triangles: triangle 0 names vertex 3 of 3"),
        (mesh(corners, "[[0, 1, 1]]"), "tool.triangles: no triangle of the mesh can be seen from below"),
        (mesh(corners, "[]"), "tool.triangles: no triangle"),
        (mesh("[[0.0, 0.0, nan]]", "[[0, 0, 0]]"), "tool.triangles: vertex 0 is not finite"),
        (
            format!("shape = 'mesh'\nvertices_mm = {corners}"),
            "tool.shape: this shape has vertices_mm and triangles",
        ),
    ] {
        let raw: RawIndenter = toml::from_str(&text).unwrap();
        let WrongField { field, problem } = raw.check("tool").unwrap_err();
        assert!(format!("{field}: {problem}").starts_with(error), "{text}: {field}: {problem}");
    }
}
