"""The check that text from outside goes through one place accepts the tree and rejects planted faults."""
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import check_text  # noqa: E402

PLANTED = [
    ("run/src/bad.cpp", 'std::string path = directory + "/" + behaviour.name + ".consac";', "makes a path of a name"),
    ("run/src/bad.cpp", 'return folder + behaviour + ".consac";', "makes a path of a name"),
    ("run/src/bad.cpp", 'Save(folder + "/" + request().model_name);', "makes a path of a name"),
    ("core/src/server/bad.cpp", "const Json json = Json::parse(text, nullptr, false);", "reads JSON by itself"),
    ("cli/bad.cpp", "const nlohmann::json spec = nlohmann::json::parse(text);", "reads JSON by itself"),
    ("run/src/bad.cpp", "const std::string text = json.dump(2);", "writes JSON by itself"),
    ("cli/bad.cpp", 'std::fprintf(stderr, "%s", message);', "prints by itself"),
    ("run/src/bad.cpp", 'std::cout << behaviour.name;', "prints by itself"),
    ("core/src/server/bad.cpp", "return hello.token == options_.token;", "compares a secret"),
    ("core/src/server/bad.cpp", "if (hello.resume != resume_) return false;", "compares a secret"),
    ("engines/host/bad.cpp", "if (std::memcmp(given.data(), options.token.data(), 8) == 0) Open();", "compares a secret"),
    ("cli/bad.cpp", 'fmt::print("{}", name);', "prints by itself"),
    ("engines/unreal/Consac/Source/Consac/Private/Bad.cpp", 'Save(Folder + "/" + Kinds[B].Offering.name + ".x");', "makes a path of a name"),
]
RIGHT = [
    ("run/src/good.cpp", 'const std::string path = folder + "/" + FileNameOf(behaviour.name, ".consac");'),
    ("run/src/good.cpp", '// json.dump() is not for us'),
    ("core/src/server/good.cpp", "if (!options_.token.empty() && !SameSecret(options_.token, hello.token)) Refuse();"),
    ("core/src/base/json.cpp", "SaxJson::sax_parse(text.begin(), text.end(), &watch);"),
    ("core/test/base/json_test.cpp", "json::parse(file);"),
    ("run/src/good.cpp", 'const Result<nlohmann::json> read = ReadJson<nlohmann::json>(text);'),
]


def plant(tmp_path, path, line):
    file = tmp_path / path
    file.parent.mkdir(parents=True)
    file.write_text(line + "\n")
    return check_text.check_tree(tmp_path)


def test_the_tree_has_one_way_for_text_from_outside():
    assert check_text.check_tree(ROOT) == []


@pytest.mark.parametrize("path, line, fault", PLANTED)
def test_a_planted_fault_is_found(tmp_path, path, line, fault):
    found = plant(tmp_path, path, line)
    assert len(found) == 1 and fault in found[0]


@pytest.mark.parametrize("path, line", RIGHT)
def test_what_goes_the_right_way_is_accepted(tmp_path, path, line):
    assert plant(tmp_path, path, line) == []
