// `consac twin view` as a program (CONSAC_PROGRAM): whom its page answers, and what nobody can make it do.
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "consac/transport/transport.h"
#include "tests/cli/program_fixture.h"

namespace consac::testing {
namespace {

constexpr double kPatience = 30.0;  // s

// An answer, or what came instead of one.
struct Answered {
  int status = 0;  // 0: the connection ended without one
  std::string head, body;
};

class TwinView : public ProgramTest {
 protected:
  TwinView() {
    std::string urdf = "<robot name='arm'><link name='world'/>", parent = "world";
    for (const char* number : {"1", "2", "7", "3", "4", "5", "6"}) {  // joints as YuMi's right arm has them
      const std::string link = std::string("link_") + number;
      urdf += "<link name='" + link + "'><visual><geometry><box size='.1 .1 .2'/></geometry></visual></link>" +
              "<joint name='yumi_joint_" + number + "_r' type='revolute'><parent link='" + parent + "'/><child link='" +
              link + "'/><origin xyz='0.1 0 0.2' rpy='0.3 0 0'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' " +
              "effort='1' velocity='1'/></joint>";
      parent = link;
    }
    std::ofstream(folder() + "/arm.urdf") << urdf + "</robot>";
  }
  // Serves `arm.urdf` with more arguments.
  void Serve(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"twin", "view", "arm.urdf", "--port", "0", "--port-file", "port"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    program_.emplace(folder(), arguments);
    std::string written;
    for (int i = 0; i < 3000 && written.empty(); ++i) {
      written = TextOf(folder() + "/port");
      usleep(10000);
    }
    ASSERT_FALSE(written.empty()) << program_->error();
    here_.port = std::atoi(written.c_str());
  }
  std::unique_ptr<Transport> Connect() const { return std::move(*ConnectTcp(here_, kPatience)); }
  // All that comes until the end.
  static Answered Hear(Transport& peer) {
    std::string all;
    std::array<std::byte, 65536> bytes;
    for (;;) {
      const Result<std::size_t> read = peer.Read(bytes, kPatience);
      if (!read.ok() || *read == 0) break;
      all.append(reinterpret_cast<const char*>(bytes.data()), *read);
    }
    const std::size_t end = all.find("\r\n\r\n");
    if (end == std::string::npos) return {};
    return {std::atoi(all.c_str() + 9), all.substr(0, end), all.substr(end + 4)};
  }
  Answered Raw(const std::string& bytes) const {
    const std::unique_ptr<Transport> peer = Connect();
    (void)peer->Write(std::as_bytes(std::span<const char>(bytes)), kPatience);
    return Hear(*peer);
  }
  std::string Host() const { return "Host: 127.0.0.1:" + std::to_string(here_.port) + "\r\n"; }
  Answered Get(const std::string& path, const std::string& headers = "") const {
    return Raw("GET " + path + " HTTP/1.1\r\n" + Host() + headers + "\r\n");
  }
  Answered Post(const std::string& path, const std::string& body, const std::string& headers = "") const {
    return Raw("POST " + path + " HTTP/1.1\r\n" + Host() + "Content-Type: application/json\r\n" + headers +
               "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  int End() {
    program_->Signal(SIGINT);
    return program_->Wait().code;
  }

  // What stands on standard error, once `part` is there.
  std::string Said(const std::string& part) const {
    for (int i = 0; i < 3000 && program_->error().find(part) == std::string::npos; ++i) usleep(10000);
    return program_->error();
  }

  std::array<std::byte, 4096> bytes_;
  std::optional<Program> program_;
  Endpoint here_;
};

TEST_F(TwinView, ServesItsPageAndNothingElse) {
  Serve();
  for (const char* path :
       {"/", "/viewer.css", "/matrix.js", "/scene.js", "/viewer.js", "/candidates.js", "/twin.json", "/twin.glb"}) {
    const Answered answer = Get(path);
    EXPECT_EQ(answer.status, 200) << path;
    EXPECT_NE(answer.head.find("Content-Length: " + std::to_string(answer.body.size())), std::string::npos) << path;
    EXPECT_NE(answer.head.find("default-src 'none'"), std::string::npos) << path;
    EXPECT_EQ(Post(path, "{}").status, 405) << path;
  }
  EXPECT_EQ(Get("/twin.glb").body.substr(0, 4), "glTF");
  for (const char* path : {"/../arm.urdf", "/arm.urdf", "/%2e%2e/arm.urdf", "/index.html", "//", "/twin.json?x",
                           "/etc/passwd", "/viewer.js/", "arm.urdf", "*", "/pose", "/viewer/viewer.js"})
    EXPECT_EQ(Get(path).status, 404) << path;
  EXPECT_EQ(Get("/play").body, "null") << "no model was given";
  EXPECT_EQ(Get("/candidates").body, "null") << "no CAD file is shown";
  EXPECT_EQ(Post("/hints", "{\"token\": \"\", \"hints\": {}}").status, 404);
  EXPECT_EQ(Post("/play", "{\"do\": \"start\"}").status, 404);
  EXPECT_EQ(End(), 130);
  EXPECT_NE(program_->out().find("arm is shown at http://127.0.0.1:"), std::string::npos);
}

TEST_F(TwinView, ThePoseIsThatOfTheProgram) {
  Serve();
  const std::string positions = "0.5,-0.25,1,0.125,-2,0,0.75";
  const Answered answer = Post("/pose", "{\"positions\": [" + positions + "]}");
  ASSERT_EQ(answer.status, 200) << answer.body;
  const nlohmann::json page = nlohmann::json::parse(answer.body);
  const nlohmann::json said =
      nlohmann::json::parse(RunProgram(folder(), {"twin", "fk", "arm.urdf", "--json", "--q", positions}).out);
  ASSERT_EQ(page.size(), said.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    for (const char* member : {"link", "position", "rotation"}) EXPECT_EQ(page[i][member], said[i][member]);
  }
  EXPECT_EQ(page[7]["rpy"].size(), 3u);
  for (const char* body : {"", "{}", "[]", "{\"positions\": 1}", "{\"positions\": [1,2]}",
                           "{\"positions\": [1,2,3,4,5,6,\"7\"]}", "{\"positions\": [1,2,3,4,5,6,1e300]}",
                           "{\"positions\": [1,2,3,4,5,6,1e999]}", "{\"positions\"", "[[[[[[[[[[[[[[[[[[[[[[[[[[["})
    EXPECT_EQ(Post("/pose", body).status, 400) << body;
  EXPECT_EQ(End(), 130);
}

TEST_F(TwinView, AnswersNoOtherSite) {
  Serve();
  const std::string port = std::to_string(here_.port);
  const auto with = [&](const std::string& headers) { return Raw("GET / HTTP/1.1\r\n" + headers + "\r\n").status; };
  EXPECT_EQ(with("Host: localhost:" + port + "\r\n"), 200);
  EXPECT_EQ(with("hOsT:  LOCALHOST:" + port + " \r\n"), 200);
  for (const std::string& host :
       {std::string("evil.example"), "evil.example:" + port, std::string("127.0.0.1"), std::string("localhost:1"),
        "127.0.0.1.evil.example:" + port, "127.0.0.1:" + port + ".a", "user@127.0.0.1:" + port, std::string()})
    EXPECT_EQ(with("Host: " + host + "\r\n"), 403) << host;
  EXPECT_EQ(with(""), 403) << "no Host";
  EXPECT_EQ(with(Host() + Host()), 400) << "two Hosts";
  EXPECT_EQ(Get("/", "Origin: http://127.0.0.1:" + port + "\r\n").status, 200);
  for (const std::string& origin :
       {std::string("null"), std::string("https://evil.example"), "https://127.0.0.1:" + port,
        std::string("http://127.0.0.1"), "http://127.0.0.1:" + port + "/"})
    EXPECT_EQ(Post("/pose", "{}", "Origin: " + origin + "\r\n").status, 403) << origin;
  EXPECT_EQ(Get("/", "Sec-Fetch-Site: cross-site\r\n").status, 403);
  EXPECT_EQ(Get("/", "Sec-Fetch-Site: same-site\r\n").status, 403);
  EXPECT_EQ(Get("/", "Sec-Fetch-Site: same-origin\r\n").status, 200);
  const std::string body = "{\"positions\": [0,0,0,0,0,0,0]}",
                    length = "Content-Length: " + std::to_string(body.size());
  for (const char* type : {"", "Content-Type: text/plain\r\n", "Content-Type: application/x-www-form-urlencoded\r\n"})
    EXPECT_EQ(Raw("POST /pose HTTP/1.1\r\n" + Host() + type + length + "\r\n\r\n" + body).status, 415) << type;
  EXPECT_EQ(End(), 130);
}

TEST_F(TwinView, BadRequestsGetAShortAnswer) {
  Serve();
  const auto status = [&](const std::string& bytes) {
    const Answered answer = Raw(bytes);
    EXPECT_LT(answer.body.size(), 200u);
    return answer.status;
  };
  EXPECT_EQ(status("\x16\x03\x01 TLS"), 405);
  EXPECT_EQ(status("DELETE / HTTP/1.1\r\n\r\n"), 405);
  EXPECT_EQ(status("PUT / HTTP/1.1\r\n" + Host() + "\r\n"), 405);
  EXPECT_EQ(status("GET /\r\n\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/2\r\n\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/1.1\r\n" + Host() + "no header\r\n\r\n"), 400);
  EXPECT_EQ(status("GET / HTTP/1.1\r\n" + Host() + " folded: line\r\n\r\n"), 400);
  EXPECT_EQ(status(std::string("GET / HTTP/1.1\r\nX: \0\r\n\r\n", 25)), 400);
  EXPECT_EQ(status("GET / HTTP/1.1\r\n" + Host() + "Content-Length: 3\r\n\r\nabc"), 400);
  EXPECT_EQ(status("POST /pose HTTP/1.1\r\n" + Host() + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 400);
  for (const char* length : {"-1", "1x", "+5", "", "0x10"})
    EXPECT_EQ(status("POST /pose HTTP/1.1\r\n" + Host() + "Content-Length: " + length + "\r\n\r\n"), 400) << length;
  for (const char* length : {"1048577", "99999999999999999999999"})
    EXPECT_EQ(status("POST /pose HTTP/1.1\r\n" + Host() + "Content-Length: " + length + "\r\n\r\n"), 413) << length;
  EXPECT_EQ(status("GET / HTTP/1.1\r\nX: " + std::string(17000, 'x')), 431);
  EXPECT_EQ(status("GET / HTTP/1.1\r\nX: " + std::string(17000, 'x') + "\r\n\r\n"), 431);
  std::mt19937 random(1);
  const std::string good =
      "POST /pose HTTP/1.1\r\n" + Host() + "Content-Type: application/json\r\nContent-Length: 2\r\n\r\n{}";
  for (int i = 0; i < 300; ++i) {  // a request with bytes changed, cut anywhere
    std::string bytes = good.substr(0, 1 + random() % good.size());
    for (std::size_t n = 1 + random() % 4; n > 0; --n) bytes[random() % bytes.size()] = static_cast<char>(random());
    const std::unique_ptr<Transport> peer = Connect();
    (void)peer->Write(std::as_bytes(std::span<const char>(bytes)), kPatience);
  }
  EXPECT_EQ(Get("/").status, 200);
  EXPECT_EQ(End(), 130);
}

TEST_F(TwinView, NobodyIsKeptWaitingByWhoIsSlow) {
  Serve({"--deadline", "3"});
  std::vector<std::unique_ptr<Transport>> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(Connect());
  const std::unique_ptr<Transport> slow = Connect();
  (void)slow->Write(std::as_bytes(std::span<const char>("GET / HT", 8)), kPatience);
  EXPECT_EQ(Get("/").status, 200) << "while others say nothing";
  Result<std::size_t> heard = std::size_t{0};
  for (int i = 0; i < 150 && heard.ok(); ++i) {  // 15 s of a byte every 0.1 s, five times what it has
    (void)slow->Write(std::as_bytes(std::span<const char>("x", 1)), kPatience);
    heard = slow->Read(std::span(bytes_), 0.1);
    EXPECT_EQ(heard.ok() ? *heard : 0u, 0u);
  }
  EXPECT_EQ(heard.status().code(), StatusCode::kUnavailable) << "its time ends, however it spends it";
  for (int i = 0; i < 100; ++i) silent.push_back(Connect());
  EXPECT_EQ(Get("/").status, 200) << "more than are taken at once: once the first have had their time";
  EXPECT_EQ(End(), 130);
}

TEST_F(TwinView, AModelPlaysOnTheTwinOfItsWorld) {
  const Outcome trained = RunProgram(
      folder(), {"train", "yumi-reach-dense-v0", "--steps", "300", "--name", "reach", "--no-table", "--no-progress"});
  ASSERT_EQ(trained.code, 0) << trained.error;
  Serve({"--model", "reach"});
  const auto play = [&] { return nlohmann::json::parse(Get("/play").body); };
  const nlohmann::json begin = play();
  EXPECT_EQ(begin["running"], false);
  EXPECT_EQ(begin["joints"].size(), 7u);
  EXPECT_NEAR(begin["tools"][0][0].get<double>(), 0.35, 1e-3) << "the ready pose";
  EXPECT_EQ(Post("/play", "{\"do\": \"start\"}").status, 200);
  nlohmann::json now = play();
  for (int i = 0; i < 3000 && now["step"].get<int>() < 2; ++i) {
    usleep(10000);
    now = play();
  }
  EXPECT_NE(now["joints"], begin["joints"]);
  if (now["episode"] == 1) {  // a busy machine sees a later one
    EXPECT_EQ(now["targets"], begin["targets"]);
  }
  EXPECT_EQ(nlohmann::json::parse(Post("/play", "{\"do\": \"reset\"}").body), begin);
  for (const char* body : {"", "{\"do\": 1}", "{\"do\": \"run\"}", "\"start\""})
    EXPECT_EQ(Post("/play", body).status, 400) << body;
  EXPECT_EQ(End(), 130);
}

#if defined(__linux__)
TEST_F(TwinView, AConnectionThatCannotBeTakenEndsNothing) {
  Serve();
  rlimit before{};
  ASSERT_EQ(prlimit(program_->pid(), RLIMIT_NOFILE, nullptr, &before), 0);
  const rlimit none{3, before.rlim_max};
  ASSERT_EQ(prlimit(program_->pid(), RLIMIT_NOFILE, &none, nullptr), 0);
  const std::unique_ptr<Transport> peer = Connect();
  const std::string asked = "GET / HTTP/1.1\r\n" + Host() + "\r\n";
  ASSERT_TRUE(peer->Write(std::as_bytes(std::span<const char>(asked)), kPatience).ok());
  EXPECT_NE(Said("cannot accept").find("cannot accept a connection"), std::string::npos);
  ASSERT_EQ(prlimit(program_->pid(), RLIMIT_NOFILE, &before, nullptr), 0);
  EXPECT_EQ(Hear(*peer).status, 200);
  const std::string error = program_->error();
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  EXPECT_EQ(End(), 130);
}

TEST_F(TwinView, SaysWhereThereIsNoBrowserToAskFor) {
  const char* path = std::getenv("PATH");
  const std::string before = path == nullptr ? "" : path;
  setenv("PATH", folder().c_str(), 1);
  Serve({"--open"});
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(Get("/").status, 200);
  EXPECT_NE(program_->error().find("no browser could be asked for"), std::string::npos) << program_->error();
  EXPECT_EQ(End(), 130);
}
#endif

TEST_F(TwinView, TellsTheWarningsOfADescription) {
  const std::string text = TextOf(folder() + "/arm.urdf");
  std::ofstream(folder() + "/arm.urdf") << text.substr(0, text.rfind("</robot>"))
                                        << "<link name='loose'/><joint name='floats' type='floating'>"
                                           "<parent link='world'/><child link='loose'/></joint></robot>";
  Serve({"--deflection", "0.5"});  // a flag of STEP files
  EXPECT_EQ(Get("/").status, 200);
  EXPECT_EQ(End(), 130);
  EXPECT_NE(program_->out().find("warning: "), std::string::npos) << program_->out();
  EXPECT_NE(program_->out().find("floats"), std::string::npos) << program_->out();
}

TEST_F(TwinView, SaysInOneLineWhatIsWrong) {
  const auto view = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"twin", "view"});
    return RunProgram(folder(), arguments);
  };
  ExpectRefusal(view({"none.urdf"}), 2, "none.urdf");
  ExpectRefusal(view({"."}), 2, "twin.json");
  ExpectRefusal(view({"arm.urdf", "--model", "none"}), 2, "none");
  const std::string road = SmallRun("road");
  ExpectRefusal(view({"arm.urdf", "--model", "road"}), 2, "'road-v0', which has no robot");
  setenv("TMPDIR", (folder() + "/arm.urdf").c_str(), 1);
  const Outcome nowhere = view({"arm.urdf"});
  unsetenv("TMPDIR");
  ExpectRefusal(nowhere, 6, "Not a directory");
  Serve();
  ExpectRefusal(view({"arm.urdf", "--port", std::to_string(here_.port)}), 2, std::to_string(here_.port));
}

}  // namespace
}  // namespace consac::testing
