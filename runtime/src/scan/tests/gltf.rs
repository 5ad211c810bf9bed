//! glTF.

use super::*;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rand::SeedableRng;

/// A square of four vertices with colours, indices of three kinds, and a sparse accessor.
const JSON: &str = r#"{"asset":{"version":"2.0"},"scene":1,"scenes":[{"nodes":[]},{"nodes":[0]}],
"nodes":[{"name":"root","children":[1],"scale":[1,1,-1],"translation":[0,0,1]},{"name":"leaf","mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"COLOR_0":2},"indices":3}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},{"bufferView":1,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"},
{"bufferView":2,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"},{"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"},
{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":3,"byteOffset":2,"componentType":5123},"values":{"bufferView":0,"byteOffset":36}}}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":16,"byteStride":4},{"buffer":0,"byteOffset":64,"byteLength":16},
{"buffer":0,"byteOffset":80,"byteLength":12}],"buffers":[{"byteLength":92}]}"#;

fn bytes() -> Vec<u8> {
    let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = positions.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend([0, 0, 127, 99].repeat(4));
    bytes.extend([255, 0, 0, 255].repeat(4));
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

/// What is read of a GLB file with the usual bytes.
fn read_glb(json: &str) -> Result<Scan, String> {
    let (_folder, path) = file("a.glb", glb(json, &bytes()));
    read(&path, &ReadOptions::default(), &Silent).map_err(|error| error.to_string())
}

#[test]
fn nodes_are_placed_and_mirrored() {
    let scan = read_glb(JSON).unwrap();
    // Metres; z is turned round, so that triangles and normals face -z from both.
    assert_eq!(scan.mesh.positions, [[5e3, 0.0, 1e3], [6e3, 0.0, 1e3], [6e3, 1e3, 1e3], [5e3, 1e3, 1e3]]);
    assert_eq!((scan.mesh.normals[0], &scan.mesh.triangles[..]), ([0.0, 0.0, -1.0], &[[0, 2, 1], [0, 3, 2]][..]));
    assert_eq!((scan.attributes.colours[0], scan.source.unit.as_str()), ([255, 0, 0], "m"));
    assert_eq!(scan.warnings.len(), 1, "{:?}", scan.warnings);
    let turned = JSON.replace(r#""matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]"#, r#""rotation":[0,0,1,1]"#);
    // A quarter of a turn about z.
    assert!(
        (glam::DVec3::from(read_glb(&turned).unwrap().mesh.positions[1]) - glam::DVec3::new(0.0, 1e3, 1e3)).length()
            < 1e-9
    );
}

#[test]
fn strips_fans_points_and_sparse_accessors() {
    let of = |mode: u32| JSON.replace(r#""indices":3"#, &format!(r#""mode":{mode}"#));
    let triangles = |mode| read_glb(&of(mode)).unwrap().mesh.triangles;
    assert_eq!(triangles(5), [[0, 2, 1], [1, 2, 3]]);
    assert_eq!(triangles(6), [[1, 0, 2], [2, 0, 3]]);
    assert_eq!((triangles(0).len(), read_glb(&of(0)).unwrap().mesh.positions.len()), (0, 4));
    assert!(read_glb(&of(1)).unwrap_err().contains("no vertices"));
    assert!(read_glb(&of(4)).unwrap_err().contains("it has 4 corners of triangles"));
    let sparse = read_glb(&JSON.replace(r#""POSITION":0"#, r#""POSITION":4"#)).unwrap();
    // Vertex 1 is where vertex 3 is: of the two triangles one is left.
    assert_eq!(sparse.source.triangles, 1);
}

#[test]
fn buffers_beside_the_file_and_in_it() {
    let data = format!(r#""byteLength":92,"uri":"data:application/octet-stream;base64,{}""#, STANDARD.encode(bytes()));
    let within = JSON.replace(r#""byteLength":92"#, &data);
    assert_eq!(counts("a.gltf", within), (4, 2));
    let beside = |uri: &str| JSON.replace(r#""byteLength":92"#, &format!(r#""byteLength":92,"uri":"{uri}""#));
    let (folder, path) = file("a.gltf", beside("b%20c.bin"));
    let read = || read(&path, &Unit::Mm.into(), &Silent).map_err(|error| error.to_string());
    let error = read().unwrap_err();
    assert!(error.contains("buffers[0]: `b%20c.bin`: there is no such file"), "{error}");
    std::fs::write(folder.path().join("b c.bin"), &bytes()[1..]).unwrap();
    let error = read().unwrap_err();
    assert!(error.contains("announces 92 bytes, and there are 91"), "{error}");
    std::fs::write(folder.path().join("b c.bin"), bytes()).unwrap();
    assert_eq!(read().unwrap().source.triangles, 2);
    for uri in ["../b c.bin", "/etc/hostname", "https://example.org/b.bin", "b\\\\c.bin", "%2e%2e/x"] {
        let error = scan_of("a.gltf", beside(uri)).unwrap_err();
        assert!(error.contains("in the folder of the glTF file only"), "{uri}: {error}");
    }
}

#[test]
fn wrong_gltfs_get_a_clear_error() {
    let cases = [
        (r#""version":"2.0""#, r#""version":"1.0""#, "asset: it has version `1.0`"),
        (r#""scene":1"#, r#""extensionsRequired":["KHR_draco_mesh_compression"]"#, "without compression"),
        (r#""scene":1"#, r#""extensionsRequired":["EXT_x"]"#, "the extension `EXT_x`, which is not read"),
        (r#""scene":1"#, r#""scene":2"#, "scenes[2]: it is named, but there are 2"),
        (r#""children":[1]"#, r#""children":[1,0]"#, "nodes[0]: it is a child twice, or of itself"),
        (r#""children":[1]"#, r#""children":[7]"#, "nodes[7]: it is named, but there are 2"),
        (r#""mesh":0"#, r#""mesh":1"#, "meshes[1]: it is named, but there are 1"),
        (r#""count":4"#, r#""count":5"#, "accessors[0]: its 5 elements of 12 bytes"),
        (
            r#""count":4"#,
            r#""count":18446744073709551615"#,
            "meshes[0].primitives[0]: it has more vertices than a file of this size",
        ),
        (r#""byteOffset":80"#, r#""byteOffset":81"#, "bufferViews[3]: it has 12 bytes from byte 81 on of buffer 0"),
        (r#""componentType":5123"#, r#""componentType":5130"#, "unknown componentType 5130"),
        (r#""type":"SCALAR""#, r#""type":"VEC2""#, "its type is `VEC2`; expected SCALAR"),
        (r#""count":4,"type":"VEC4""#, r#""count":3,"type":"VEC4""#, "its attributes have 3 and 4 elements"),
        (r#""byteLength":92"#, r#""byteLength":93"#, "announces 93 bytes, and there are 92"),
        (r#""byteStride":4"#, r#""byteStride":0"#, "its byteStride is 0"),
        (r#""nodes":[0]}"#, r#""nodes":[0]"#, "of the JSON"),
    ];
    for (from, to, expected) in cases {
        let error = read_glb(&JSON.replacen(from, to, 1)).unwrap_err();
        assert!(error.contains(expected), "{to}\n gave: {error}\n not: {expected}");
    }
    let mut wrong = bytes();
    wrong[80] = 4;
    let error = scan_of("a.glb", glb(JSON, &wrong)).unwrap_err();
    assert!(error.contains("meshes[0].primitives[0] names vertex 4, but there are 4"), "{error}");
    let whole = glb(JSON, &bytes());
    let error = scan_of("a.glb", &whole[..whole.len() - 1]).unwrap_err();
    assert!(error.contains("it is cut off: export it again"), "{error}");
    // A square that a thousand nodes repeat has 10,000 vertices and corners; a million are too many.
    let many = |count: usize| {
        let nodes: Vec<String> = (0..count).map(|_| r#"{"mesh":0}"#.to_owned()).collect();
        let all: Vec<String> = (0..count).map(|i| i.to_string()).collect();
        let begin = JSON.find(r#""nodes":[{"name""#).unwrap();
        let end = JSON.find(r#""meshes""#).unwrap();
        let json = format!("{}\"nodes\":[{}],\n{}", &JSON[..begin], nodes.join(","), &JSON[end..]);
        json.replace(r#"{"nodes":[0]}"#, &format!(r#"{{"nodes":[{}]}}"#, all.join(",")))
    };
    assert_eq!(read_glb(&many(1000)).unwrap().source.cleaning.repeated, 2 * 999);
}

#[test]
fn mutated_gltfs_do_no_harm() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let data = format!(r#""byteLength":92,"uri":"data:;base64,{}""#, STANDARD.encode(bytes()));
    let seeds = [glb(JSON, &bytes()), JSON.replace(r#""byteLength":92"#, &data).into_bytes()];
    for round in 0..6000 {
        let bytes = super::mutated(&seeds[round % 2], &mut random);
        if let Ok(contents) = parse("a.glb", bytes) {
            drop(finish(contents.raw, contents.unit, ScanSource::default(), &ReadOptions::default()));
        }
    }
}
