// Meshes: each format gives the same box, damaged ones are refused, welding shares what is smooth, masses are closed
// forms.
#include "consac/twin/mesh.h"

#include <cmath>

#include "tests/support.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

const std::vector<std::byte> kBox = WriteStl(TrianglesOf(ShapeKind::kBox, {1, 2, 3}));

std::span<const std::byte> Bytes(const std::string& text) {
  return std::as_bytes(std::span<const char>(text));
}

double Volume(const Triangles& triangles) {
  const auto solid = SolidOf(triangles);
  return solid.has_value() ? solid->mass : -1.0;
}

TEST(Meshes, StlComesBackTheSame) {
  const Result<Triangles> box = ReadStl(kBox);
  ASSERT_TRUE(box.ok());
  EXPECT_EQ(box->count(), 12u);
  EXPECT_EQ(WriteStl(*box), kBox);
  const Result<Triangles> text =
      ReadStl(Bytes("solid a\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1e0 +0 0\r\n  vertex 0 1 0\n "
                    "endloop\nendfacet\nendsolid"));
  ASSERT_TRUE(text.ok()) << text.status().message();
  EXPECT_EQ(text->corners, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}));
}

TEST(Meshes, DamagedStlIsRefused) {
  for (std::size_t length = 0; length < kBox.size(); ++length)
    EXPECT_FALSE(ReadStl({kBox.data(), length}).ok()) << length;
  std::vector<std::byte> bytes = kBox;
  const float bad = std::nanf("");
  std::memcpy(bytes.data() + 84 + 12, &bad, 4);
  EXPECT_FALSE(ReadStl(bytes).ok());
  for (std::size_t i = 80; i < 84; ++i) bytes[i] = std::byte{0xff};
  EXPECT_NE(ReadStl(bytes).status().message().find("4294967295 triangles would be"), std::string::npos);
  EXPECT_FALSE(ReadStl(Bytes("solid a\nouter loop\nvertex 0 0\n")).ok());
  const std::string facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  EXPECT_TRUE(ReadStl(Bytes("solid a\n" + facet + "endsolid a\n \n")).ok());
  EXPECT_TRUE(ReadStl(Bytes("solid a\n" + facet + "endsolid a\nsolid b\n" + facet + "endsolid")).ok());
  EXPECT_NE(ReadStl(Bytes("solid a\n" + facet)).status().message().find("its last line is not 'endsolid'"),
            std::string::npos);
  EXPECT_FALSE(ReadStl(Bytes("solid a\nouter loop\nvertex 0 0 0\nendloop\n")).ok());
  EXPECT_FALSE(ReadStl(Bytes("solid a\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 0 0\n")).ok());
}

TEST(Meshes, ObjFacesAreCutIntoTriangles) {
  const Result<Triangles> square = ReadObj(
      "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1/2/3 2 3//1 -1\nusemtl b\nf 1 "
      "2 3\n");
  ASSERT_TRUE(square.ok()) << square.status().message();
  EXPECT_EQ(square->count(), 3u);
  ASSERT_EQ(square->parts.size(), 1u) << "materials without colours are no parts";
  EXPECT_EQ(square->parts[0].count, 3u);
  EXPECT_FALSE(ReadObj("v 0 0 0\nf 1 2 3\n").ok());
  EXPECT_FALSE(ReadObj("v 0 0 0\nf 1 1\n").ok());
  EXPECT_FALSE(ReadObj("v 0 0 0\nf 0 1 1\n").ok());
  EXPECT_FALSE(ReadObj("v 0 x 0\n").ok());
}

const char* const kDae =
    "<COLLADA><asset><unit meter='0.01'/></asset><library_effects><effect id='e'><profile_COMMON><technique><phong>"
    "<diffuse><color>1 0.5 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>"
    "<library_materials><material id='m'><instance_effect url='#e'/></material></library_materials>"
    "<library_geometries><geometry id='g'><mesh><source id='p'><float_array>0 0 0 100 0 0 100 100 0 0 100 "
    "0</float_array></source>"
    "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
    "<polylist material='s'><input semantic='VERTEX' source='#v' offset='0'/><input semantic='NORMAL' source='#n' "
    "offset='1'/>"
    "<vcount>4</vcount><p>0 0 1 0 2 0 3 0</p></polylist></mesh></geometry></library_geometries>"
    "<library_visual_scenes><visual_scene><node><translate>0 0 100</translate><rotate>0 0 1 90</rotate>"
    "<instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='s' "
    "target='#m'/></technique_common>"
    "</bind_material></instance_geometry></node></visual_scene></library_visual_scenes></COLLADA>";

TEST(Meshes, ColladaHasUnitsPlacesAndColours) {
  const Result<Triangles> square = ReadDae(kDae);
  ASSERT_TRUE(square.ok()) << square.status().message();
  ASSERT_EQ(square->count(), 2u);
  const float expected[] = {0, 0, 1, 0, 1, 1, -1, 1, 1};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(square->corners[i], expected[i], 1e-6f) << i;
  ASSERT_EQ(square->parts.size(), 1u);
  EXPECT_EQ(*square->parts[0].colour, (Colour{1, 0.5, 0, 1}));
}

TEST(Meshes, ColladaThatDoesNotFitIsRefused) {
  const std::string whole = kDae;
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
    EXPECT_FALSE(ReadDae(text).ok()) << to;
  };
  refused("<vcount>4", "<vcount>5");
  refused("<vcount>4", "<vcount>-1");
  refused("2 0 3 0", "2 0 9 0");
  refused("source='#p'", "source='#q'");
  refused("0 0 0 100", "0 0 100");
  refused("meter='0.01'", "meter='0'");
  refused("<translate>0 0 100", "<translate>0 0");
}

TEST(Meshes, ColladaThatMirrorsIsStillSeenFromOutside) {
  const std::string whole = kDae;
  const std::string turned = "<translate>0 0 100</translate>";
  for (const char* motion : {"<scale>-1 1 1</scale>", "<scale>-1 1 1</scale><scale>1 -1 1</scale>",
                             "<matrix>1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1</matrix>"}) {
    std::string text = whole;
    const Result<Triangles> square = ReadDae(text.replace(text.find(turned), turned.size(), motion));
    ASSERT_TRUE(square.ok()) << square.status().message();
    const float* c = square->corners.data();
    const float normal = (c[3] - c[0]) * (c[7] - c[1]) - (c[4] - c[1]) * (c[6] - c[0]);
    const bool below = std::string(motion).find("matrix") != std::string::npos;  // its upper side is the lower one
    EXPECT_NEAR(normal, below ? -1.0f : 1.0f, 1e-5f) << motion;
  }
}

// A glTF of one triangle from (0, 0, 0) to (1, 0, 0) and (0, 2, 0), y up; `node` places it, `primitive` says more.
std::string GltfJson(const std::string& node, const std::string& primitive, const std::string& more = "") {
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0)" + node +
         R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1)" + primitive +
         R"(}]}], "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.21404114, 0, 0.5]}}],
         "buffers": [{"byteLength": 42}], "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
         "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                       {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}])" +
         more + "}";
}
std::string Word(std::uint32_t value) {
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(value >> (8 * i));
  return out;
}
std::string GltfNumbers() {
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 2, 0};
  std::string out(reinterpret_cast<const char*>(points), sizeof points);
  return out + std::string("\0\0\1\0\2\0", 6);
}
std::string Container(std::string json) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string numbers = GltfNumbers() + std::string(2, '\0');
  return "glTF" + Word(2) + Word(static_cast<std::uint32_t>(28 + json.size() + numbers.size())) +
         Word(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
         Word(static_cast<std::uint32_t>(numbers.size())) + std::string("BIN\0", 4) + numbers;
}
Result<Triangles> FromGltf(const std::string& bytes) {
  return ReadGltf(Bytes(bytes), [](const std::string& uri) { return GltfBase64(uri); });
}

TEST(Meshes, GltfIsTurnedToZUpPlacedAndColoured) {
  const Result<Triangles> plain = FromGltf(Container(GltfJson("", "")));
  ASSERT_TRUE(plain.ok()) << plain.status().message();
  EXPECT_EQ(plain->corners, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 0, 2}));
  ASSERT_EQ(plain->parts.size(), 1u);
  EXPECT_FALSE(plain->parts[0].colour.has_value());
  const Result<Triangles> placed = FromGltf(Container(
      GltfJson(R"(, "translation": [0, 0, 3], "rotation": [0, 0, 0.70710678, 0.70710678], "scale": [2, 1, 1])",
               R"(, "material": 0)")));
  ASSERT_TRUE(placed.ok()) << placed.status().message();
  const float expected[] = {0, -3, 0, 0, -3, 2, -2, -3, 0};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(placed->corners[i], expected[i], 1e-6f) << i;
  const Colour& colour = *placed->parts[0].colour;
  EXPECT_NEAR(colour[1], 0.5, 1e-6) << "a display's";
  EXPECT_EQ(colour[3], 0.5);
  const Result<Triangles> matrix =
      FromGltf(Container(GltfJson(R"(, "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1])", "")));
  ASSERT_TRUE(matrix.ok()) << matrix.status().message();
  EXPECT_EQ(matrix->corners, (std::vector<float>{5, 0, 0, 5, 0, 2, 4, 0, 0})) << "a mirror is still seen from outside";
}

TEST(Meshes, GltfStripsFansAndBuffersInText) {
  const std::string quad =
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAA";  // four corners of a square
  const auto text = [&](const std::string& mode) {
    return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": )" +
           mode + R"(}]}],
      "buffers": [{"byteLength": 48, "uri": "data:application/octet-stream;base64,)" +
           quad + R"("}],
      "bufferViews": [{"buffer": 0, "byteLength": 48}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]})";
  };
  const Result<Triangles> strip = FromGltf(text("5")), fan = FromGltf(text("6"));
  ASSERT_TRUE(strip.ok()) << strip.status().message();
  EXPECT_EQ(strip->corners, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 1}));
  ASSERT_TRUE(fan.ok()) << fan.status().message();
  EXPECT_EQ(fan->corners, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 1}));
  EXPECT_EQ(FromGltf(text("1"))->count(), 0u) << "lines";
}

TEST(Meshes, GltfThatDoesNotFitIsRefused) {
  const std::string whole = GltfJson("", R"(, "material": 0)");
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    const Result<Triangles> read = FromGltf(Container(text.replace(at, from.size(), to)));
    EXPECT_FALSE(read.ok()) << to;
    EXPECT_EQ(read.status().message().find('\n'), std::string::npos);
  };
  ASSERT_TRUE(FromGltf(Container(whole)).ok());
  refused("\"count\": 3, \"type\": \"VEC3\"", "\"count\": 4, \"type\": \"VEC3\"");
  refused("\"count\": 3, \"type\": \"VEC3\"", "\"count\": 2, \"type\": \"VEC3\"");
  refused("\"count\": 3, \"type\": \"VEC3\"", "\"count\": 1000000000, \"type\": \"VEC3\"");
  refused("\"count\": 3, \"type\": \"VEC3\"", "\"count\": -3, \"type\": \"VEC3\"");
  refused("\"componentType\": 5123", "\"componentType\": 5125");
  refused("\"componentType\": 5126", "\"componentType\": 5123");
  refused("\"byteOffset\": 36", "\"byteOffset\": 40");
  refused("\"byteOffset\": 36", "\"byteOffset\": 36, \"byteStride\": 1");
  refused("\"byteLength\": 42", "\"byteLength\": 4200");
  refused("\"bufferView\": 1", "\"bufferView\": 1, \"sparse\": {}");
  refused("\"bufferView\": 1", "\"bufferView\": 9");
  refused("\"mesh\": 0", "\"mesh\": 1");
  refused("\"mesh\": 0", "\"mesh\": 0, \"children\": [0]");
  refused("\"mesh\": 0", "\"mesh\": 0, \"scale\": [1, 1]");
  refused("\"material\": 0", "\"material\": 2");
  refused("\"version\": \"2.0\"", "\"version\": \"1.0\"");
  refused("\"byteLength\": 42", "\"byteLength\": 42, \"uri\": \"data:;base64,!\"");
  const std::string compressed = GltfJson("", "", R"(, "extensionsRequired": ["KHR_draco_mesh_compression"])");
  EXPECT_NE(FromGltf(Container(compressed)).status().message().find("'KHR_draco_mesh_compression', which is not read"),
            std::string::npos);
  const std::string bytes = Container(whole);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_FALSE(FromGltf(bytes.substr(0, length)).ok()) << length;
}

TEST(Meshes, GltfShowsOnlySoMuch) {
  std::string nodes = R"(, "children": [1)", list = "}";
  for (int i = 2; i < 1200; ++i) nodes += ", " + std::to_string(i);
  for (int i = 1; i < 1200; ++i) list += R"(, {"mesh": 0})";
  std::string json = GltfJson(nodes + "]", "");
  const std::size_t end = json.find("}], \"meshes\"");
  json.replace(end, 1, list);
  EXPECT_EQ(FromGltf(Container(json))->count(), 1200u);
  std::string many;
  for (int i = 0; i < 1000; ++i) many += R"(, {"attributes": {"POSITION": 0}, "mode": 0})";
  json.insert(json.find("]}], \"materials\""), many);
  EXPECT_NE(FromGltf(Container(json)).status().message().find("more than 1000000 primitives"), std::string::npos);
}

TEST(Meshes, ColladaIsReadOnceHoweverOftenItIsShown) {
  std::string text = kDae;
  const std::string instance = "<instance_geometry url='#g'/>", end = "</node></visual_scene>";
  std::string many;
  for (int i = 0; i < 50; ++i) many += instance;
  const Result<Triangles> squares = ReadDae(std::string(text).insert(text.find(end), many));
  ASSERT_TRUE(squares.ok()) << squares.status().message();
  EXPECT_EQ(squares->count(), 2u * 51u);
  // Triangles without an area leave nothing behind, and are counted all the same.
  std::string flat = "4";
  for (int i = 1; i < 100'000; ++i) flat += " 3";
  const std::string p = "<p>0 0 1 0 2 0 3 0</p>";
  text.replace(text.find(p), p.size(), "");
  std::string zeros = "<p>";
  for (int i = 0; i < 300'001; ++i) zeros += "0 0 ";
  text.replace(text.find("<vcount>4</vcount>"), 18, "<vcount>" + flat + "</vcount>" + zeros + "</p>");
  for (int i = 0; i < 250; ++i) many += instance;
  const Result<Triangles> nothing = ReadDae(std::string(text).insert(text.find(end), many));
  ASSERT_FALSE(nothing.ok());
  EXPECT_NE(nothing.status().message().find("more than 20000000 triangles"), std::string::npos)
      << nothing.status().message();
  // So are instances of what has no faces, and materials.
  many.clear();
  for (int i = 0; i < 2000; ++i) many += "<instance_node url='#many'/>";
  std::string library = "<library_nodes><node id='many'>";
  for (int i = 0; i < 2000; ++i) library += "<instance_geometry url='#none'/>";
  text = kDae;
  text.insert(text.find(end), many);
  const Result<Triangles> much =
      ReadDae(text.insert(text.find("<library_geometries>"), library + "</node></library_nodes>"));
  ASSERT_FALSE(much.ok());
  EXPECT_NE(much.status().message().find("shows too much"), std::string::npos) << much.status().message();
}

TEST(Meshes, ColladaNodesThatHoldEachOtherEnd) {
  const Result<Triangles> loop = ReadDae(
      "<COLLADA><library_nodes><node id='a'><instance_node url='#a'/><instance_node url='#a'/></node></library_nodes>"
      "<library_visual_scenes><visual_scene><node><instance_node "
      "url='#a'/></node></visual_scene></library_visual_scenes></COLLADA>");
  ASSERT_FALSE(loop.ok());
  EXPECT_NE(loop.status().message().find("nodes that hold each other"), std::string::npos);
}

TEST(Meshes, WeldingKeepsSharpEdgesAndSharesSmoothOnes) {
  const Mesh box = Weld(*ReadStl(kBox));
  EXPECT_EQ(box.positions.size() / 3, 24u) << "three vertices at each corner";
  const Triangles ball = TrianglesOf(ShapeKind::kSphere, {1, 1, 1});
  const Mesh round = Weld(ball);
  EXPECT_EQ(round.indices.size(), 3 * ball.count());
  EXPECT_LT(round.positions.size() / 3, ball.count()) << "a closed smooth mesh has half as many vertices as triangles";
  for (std::size_t i = 0; i < round.normals.size(); i += 3) {
    const double dot = double{round.normals[i]} * double{round.positions[i]} +
                       double{round.normals[i + 1]} * double{round.positions[i + 1]} +
                       double{round.normals[i + 2]} * double{round.positions[i + 2]};
    EXPECT_GT(dot, 0.99) << "normals point outwards";
  }
}

TEST(Meshes, SolidsHaveTheMassOfTheirFormulas) {
  const auto box = SolidOf(*ReadStl(kBox));
  ASSERT_TRUE(box.has_value());
  EXPECT_NEAR(box->mass, 6.0, 1e-12);
  EXPECT_NEAR(box->inertia[0], 6.0 * (4 + 9) / 12.0, 1e-12);
  EXPECT_NEAR(box->inertia[3], 6.0 * (1 + 9) / 12.0, 1e-12);
  EXPECT_NEAR(box->inertia[1], 0.0, 1e-12);
  EXPECT_NEAR(Volume(TrianglesOf(ShapeKind::kCylinder, {1, 1, 2})), 2 * robot::kPiRadians, 0.05);
  EXPECT_NEAR(Volume(TrianglesOf(ShapeKind::kCapsule, {1, 1, 2})), (2 + 4.0 / 3.0) * robot::kPiRadians, 0.15);
  Triangles open = *ReadStl(kBox);
  open.corners.resize(9 * 11);
  EXPECT_FALSE(SolidOf(open).has_value());
  Triangles mirrored = *ReadStl(kBox);
  Scale({-1, 2, 1}, &mirrored);
  EXPECT_NEAR(Volume(mirrored), 12.0, 1e-5) << "still seen from outside";
}

TEST(Meshes, AnUnknownEndingAndAnEmptyFileAreNamed) {
  const testing::ScratchFolder scratch("meshes");
  EXPECT_NE(ReadMesh(scratch.path() + "/a.fbx").status().message().find("its ending is '.fbx'"), std::string::npos);
  Put(scratch.path() + "/a.obj", "v 0 0 0\n");
  EXPECT_NE(ReadMesh(scratch.path() + "/a.obj").status().message().find("holds no triangle"), std::string::npos);
  EXPECT_EQ(ReadMesh(scratch.path() + "/b.STL").status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace consac::twin
