// Measures the ray rates of Embree 4 (the library in the embreex wheel) on one .tri scene: the build, and primary,
// shadow and bounce rays, as single rays and in packets of 16. `--dump` also writes the rays and Embree's results to files, so
// that another ray tracer can trace the same rays. embree_race.py compiles and runs this program.
// Usage: embree_race_rates SCENE_PREFIX [--threads N] [--size WxH] [--robust] [--compact] [--quality low|medium|high] [--isa avx2] [--dump DIR]
#include <algorithm>
#include <immintrin.h>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>
// The part of Embree 4's C ABI that this program uses. It is declared here, because the embreex wheel has no headers.
extern "C" {
struct RTCDeviceT; struct RTCSceneT; struct RTCGeometryT; typedef RTCDeviceT* RTCDevice; typedef RTCSceneT* RTCScene; typedef RTCGeometryT* RTCGeometry;
struct alignas(16) RTCRay { float org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, time, tfar; unsigned mask, id, flags; };
struct alignas(16) RTCHit { float Ng_x, Ng_y, Ng_z, u, v; unsigned primID, geomID, instID[1], instPrimID[1]; };
struct RTCRayHit { RTCRay ray; RTCHit hit; };
struct alignas(64) RTCRay16 { float org_x[16], org_y[16], org_z[16], tnear[16], dir_x[16], dir_y[16], dir_z[16], time[16], tfar[16]; unsigned mask[16], id[16], flags[16]; };
struct alignas(64) RTCHit16 { float Ng_x[16], Ng_y[16], Ng_z[16], u[16], v[16]; unsigned primID[16], geomID[16], instID[1][16], instPrimID[1][16]; };
struct RTCRayHit16 { RTCRay16 ray; RTCHit16 hit; };
struct QueryArguments { int flags = 0; unsigned feature_mask = 0xffffffffu; void *context = nullptr, *filter = nullptr, *call = nullptr; };
typedef bool (*RTCMemoryMonitorFunction)(void*, ssize_t, bool);
RTCDevice rtcNewDevice(const char*); void rtcSetDeviceMemoryMonitorFunction(RTCDevice, RTCMemoryMonitorFunction, void*);
RTCScene rtcNewScene(RTCDevice); void rtcReleaseScene(RTCScene); void rtcSetSceneBuildQuality(RTCScene, int); void rtcSetSceneFlags(RTCScene, int); void rtcCommitScene(RTCScene);
RTCGeometry rtcNewGeometry(RTCDevice, int); void rtcReleaseGeometry(RTCGeometry); void rtcCommitGeometry(RTCGeometry); unsigned rtcAttachGeometry(RTCScene, RTCGeometry);
void rtcSetSharedGeometryBuffer(RTCGeometry, int type, unsigned slot, int format, const void*, size_t offset, size_t stride, size_t count);
void rtcIntersect1(RTCScene, RTCRayHit*, QueryArguments*); void rtcIntersect16(const int*, RTCScene, RTCRayHit16*, QueryArguments*);
void rtcOccluded1(RTCScene, RTCRay*, QueryArguments*); void rtcOccluded16(const int*, RTCScene, RTCRay16*, QueryArguments*);
}
enum { QUALITY_LOW, QUALITY_MEDIUM, QUALITY_HIGH, SCENE_ROBUST = 4, SCENE_COMPACT = 2, TRIANGLES = 0, INDEX_BUFFER = 0, VERTEX_BUFFER = 1, UINT3 = 0x5003, FLOAT3 = 0x9003, COHERENT = 1 << 16 };
const unsigned NOTHING = ~0u;
using clk = std::chrono::steady_clock;
static double secs(clk::time_point a) { return std::chrono::duration<double>(clk::now() - a).count(); }
struct V { float x, y, z; };
static V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static V operator*(V a, float s) { return {a.x * s, a.y * s, a.z * s}; }
static float dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static V cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static V unit(V a) { return a * (1 / std::sqrt(dot(a, a))); }
struct Ray { V o, d; float tfar; };
static uint64_t rngs = 88172645463325252ull;
static float rnd() { rngs ^= rngs << 13; rngs ^= rngs >> 7; rngs ^= rngs << 17; return (rngs >> 40) * (1.f / 16777216.f); }
static int threads = 2;
static void parallel(size_t n, size_t grain, const std::function<void(size_t, size_t)>& f) {
  std::atomic<size_t> next{0};
  auto work = [&] { _mm_setcsr(_mm_getcsr() | 0x8040); for (;;) { size_t b = next.fetch_add(grain); if (b >= n) break; f(b, std::min(n, b + grain)); } };
  std::vector<std::thread> ts; for (int i = 1; i < threads; i++) ts.emplace_back(work);
  work(); for (auto& t : ts) t.join();
}
static std::atomic<size_t> peak{0};
static std::atomic<ssize_t> held{0};
static bool mem(void*, ssize_t b, bool) { held += b; size_t h = held; if (h > peak) peak = h; return true; }
int main(int argc, char** argv) {
  std::string scene = argv[1], dump, isa; int W = 1024, H = 768; bool robust = false; bool compact = false; int q = QUALITY_MEDIUM;
  for (int i = 2; i < argc; i++) {
    std::string a = argv[i];
    if (a == "--threads") threads = atoi(argv[++i]);
    else if (a == "--size") sscanf(argv[++i], "%dx%d", &W, &H);
    else if (a == "--robust") robust = true;
    else if (a == "--compact") compact = true;
    else if (a == "--dump") dump = argv[++i];
    else if (a == "--isa") isa = std::string(",isa=") + argv[++i];
    else if (a == "--quality") { std::string s = argv[++i]; q = s == "low" ? QUALITY_LOW : s == "high" ? QUALITY_HIGH : QUALITY_MEDIUM; }
  }
  std::ifstream f(scene + ".tri", std::ios::binary); uint32_t nv, nt; f.read((char*)&nv, 4); f.read((char*)&nt, 4);
  std::vector<V> v(nv + 1); std::vector<uint32_t> ix(3 * (size_t)nt);
  f.read((char*)v.data(), 12ull * nv); f.read((char*)ix.data(), 12ull * nt);
  float c[13]; std::ifstream(scene + ".cam", std::ios::binary).read((char*)c, sizeof c);
  V eye{c[0], c[1], c[2]}, at{c[3], c[4], c[5]}, up{c[6], c[7], c[8]}, light{c[10], c[11], c[12]};
  char cfg[64]; snprintf(cfg, sizeof cfg, "threads=%d,set_affinity=0%s", threads, isa.c_str());
  RTCDevice dev = rtcNewDevice(cfg); rtcSetDeviceMemoryMonitorFunction(dev, mem, nullptr);
  RTCScene sc; double build = 1e9;
  for (int r = 0; r < 3; r++) {
    if (r) rtcReleaseScene(sc);
    auto t0 = clk::now(); sc = rtcNewScene(dev);
    rtcSetSceneBuildQuality(sc, q); rtcSetSceneFlags(sc, (robust ? SCENE_ROBUST : 0) | (compact ? SCENE_COMPACT : 0));
    RTCGeometry g = rtcNewGeometry(dev, TRIANGLES);
    rtcSetSharedGeometryBuffer(g, VERTEX_BUFFER, 0, FLOAT3, v.data(), 0, 12, nv);
    rtcSetSharedGeometryBuffer(g, INDEX_BUFFER, 0, UINT3, ix.data(), 0, 12, nt);
    rtcCommitGeometry(g); rtcAttachGeometry(sc, g); rtcReleaseGeometry(g); rtcCommitScene(sc);
    build = std::min(build, secs(t0));
  }
  printf("build %.3f s  %.2f Mtri/s  held %.1f B/tri  peak %.1f B/tri\n", build, nt / build / 1e6, (double)held / nt, (double)peak / nt);
  V w = unit(at - eye), u = unit(cross(w, up)), t = cross(u, w); float k = std::tan(c[9] * float(M_PI) / 360);
  std::vector<Ray> prim, shadow, bounce; prim.reserve(W * H);
  // Rays are in tiles of 8 x 8 pixels, each made of four tiles of 4 x 4: 16 consecutive rays form a packet.
  for (int ty = 0; ty < H; ty += 8) for (int tx = 0; tx < W; tx += 8) for (int q = 0; q < 4; q++) for (int p = 0; p < 16; p++) {
    int x = tx + (q & 1) * 4 + (p & 3), y = ty + (q >> 1) * 4 + (p >> 2);
    float sx = (2 * (x + .5f) / W - 1) * k * W / H, sy = (1 - 2 * (y + .5f) / H) * k;
    prim.push_back({eye, w + u * sx + t * sy, INFINITY});
  }
  auto fill = [](RTCRayHit& r, const Ray& s) {
    r.ray.org_x = s.o.x; r.ray.org_y = s.o.y; r.ray.org_z = s.o.z; r.ray.dir_x = s.d.x; r.ray.dir_y = s.d.y; r.ray.dir_z = s.d.z;
    r.ray.tnear = 0; r.ray.tfar = s.tfar; r.ray.time = 0; r.ray.mask = -1; r.ray.id = 0; r.ray.flags = 0;
    r.hit.geomID = r.hit.primID = r.hit.instID[0] = NOTHING; };
  struct Hit { float t; uint32_t prim; };
  std::vector<Hit> ph(prim.size()), bh, shh;
  auto closest1 = [&](const std::vector<Ray>& rays, std::vector<Hit>& out, bool coherent) {
    out.resize(rays.size());
    parallel(rays.size(), 4096, [&](size_t a, size_t b) {
      QueryArguments args; args.flags = coherent ? COHERENT : 0;
      for (size_t i = a; i < b; i++) { RTCRayHit r; fill(r, rays[i]); rtcIntersect1(sc, &r, &args); out[i] = {r.ray.tfar, r.hit.primID}; } }); };
  auto closest16 = [&](const std::vector<Ray>& rays, std::vector<Hit>& out, bool coherent) {
    out.resize(rays.size());
    parallel(rays.size(), 4096, [&](size_t a, size_t b) {
      QueryArguments args; args.flags = coherent ? COHERENT : 0;
      for (size_t i = a; i < b; i += 16) {
        RTCRayHit16 r; alignas(64) int valid[16];
        for (int j = 0; j < 16; j++) { bool on = i + j < b; valid[j] = on ? -1 : 0; const Ray& s = rays[on ? i + j : i];
          r.ray.org_x[j] = s.o.x; r.ray.org_y[j] = s.o.y; r.ray.org_z[j] = s.o.z; r.ray.dir_x[j] = s.d.x; r.ray.dir_y[j] = s.d.y; r.ray.dir_z[j] = s.d.z;
          r.ray.tnear[j] = 0; r.ray.tfar[j] = s.tfar; r.ray.time[j] = 0; r.ray.mask[j] = -1; r.ray.id[j] = 0; r.ray.flags[j] = 0; r.hit.geomID[j] = r.hit.primID[j] = r.hit.instID[0][j] = NOTHING; }
        rtcIntersect16(valid, sc, &r, &args);
        for (int j = 0; j < 16 && i + j < b; j++) out[i + j] = {r.ray.tfar[j], r.hit.primID[j]}; } }); };
  auto any1 = [&](const std::vector<Ray>& rays, std::vector<Hit>& out) {
    out.resize(rays.size());
    parallel(rays.size(), 4096, [&](size_t a, size_t b) {
      QueryArguments args;
      for (size_t i = a; i < b; i++) { RTCRayHit r; fill(r, rays[i]); rtcOccluded1(sc, &r.ray, &args); out[i] = {r.ray.tfar, r.ray.tfar < 0}; } }); };
  auto any16 = [&](const std::vector<Ray>& rays, std::vector<Hit>& out) {
    out.resize(rays.size());
    parallel(rays.size(), 4096, [&](size_t a, size_t b) {
      QueryArguments args; args.flags = COHERENT;
      for (size_t i = a; i < b; i += 16) {
        RTCRay16 r; alignas(64) int valid[16];
        for (int j = 0; j < 16; j++) { bool on = i + j < b; valid[j] = on ? -1 : 0; const Ray& s = rays[on ? i + j : i];
          r.org_x[j] = s.o.x; r.org_y[j] = s.o.y; r.org_z[j] = s.o.z; r.dir_x[j] = s.d.x; r.dir_y[j] = s.d.y; r.dir_z[j] = s.d.z;
          r.tnear[j] = 0; r.tfar[j] = s.tfar; r.time[j] = 0; r.mask[j] = -1; r.id[j] = 0; r.flags[j] = 0; }
        rtcOccluded16(valid, sc, &r, &args);
        for (int j = 0; j < 16 && i + j < b; j++) out[i + j] = {r.tfar[j], r.tfar[j] < 0}; } }); };
  auto rate = [&](const char* name, size_t n, const std::function<void()>& go) {
    go(); double best = 1e9; std::vector<double> all; for (int i = 0; i < 7; i++) { auto a = clk::now(); go(); double s = secs(a); best = std::min(best, s); all.push_back(s); }
    std::sort(all.begin(), all.end()); printf("%-10s best %7.2f  median %7.2f Mray/s\n", name, n / best / 1e6, n / all[3] / 1e6); };
  rate("primary1", prim.size(), [&] { closest1(prim, ph, true); });
  rate("primary16", prim.size(), [&] { closest16(prim, ph, true); });
  size_t hits = 0;
  for (size_t i = 0; i < prim.size(); i++) if (ph[i].prim != NOTHING) {
    hits++; const Ray& s = prim[i]; const uint32_t* p = &ix[3 * (size_t)ph[i].prim];
    V a = v[p[0]], n = unit(cross(v[p[1]] - a, v[p[2]] - a)); if (dot(n, s.d) > 0) n = n * -1;
    V x = s.o + s.d * ph[i].t + n * 1e-4f; V l = light - x; float r2 = rnd(), ph2 = 6.2831853f * rnd(), sr = std::sqrt(r2);
    shadow.push_back({x, l, 1.f});
    V e1 = unit(cross(std::fabs(n.x) > .5f ? V{0, 1, 0} : V{1, 0, 0}, n)), e2 = cross(n, e1);
    bounce.push_back({x, e1 * (sr * std::cos(ph2)) + e2 * (sr * std::sin(ph2)) + n * std::sqrt(1 - r2), INFINITY}); }
  rate("shadow1", shadow.size(), [&] { any1(shadow, shh); });
  rate("shadow16", shadow.size(), [&] { any16(shadow, shh); });
  rate("bounce1", bounce.size(), [&] { closest1(bounce, bh, false); });
  rate("bounce16", bounce.size(), [&] { closest16(bounce, bh, false); });
  printf("rays %zu primary, %zu hit; occluded %zu\n", prim.size(), hits, (size_t)std::count_if(shh.begin(), shh.end(), [](Hit h) { return h.prim; }));
  if (!dump.empty()) {
    auto put = [&](const char* n, const void* p, size_t b) { std::ofstream(dump + "/" + n, std::ios::binary).write((const char*)p, b); };
    put("primary.rays", prim.data(), prim.size() * sizeof(Ray)); put("primary.hits", ph.data(), ph.size() * 8);
    put("shadow.rays", shadow.data(), shadow.size() * sizeof(Ray)); put("shadow.hits", shh.data(), shh.size() * 8);
    put("bounce.rays", bounce.data(), bounce.size() * sizeof(Ray)); put("bounce.hits", bh.data(), bh.size() * 8);
  }
}
