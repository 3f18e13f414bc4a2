#include "bodyschema/gl/context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bodyschema/gl/functions.hpp"

namespace bodyschema::gl {
namespace {

using GetFunction = void (*(*)(const char*))();

struct Version {
  int major, minor;
};
constexpr std::array kVersions{Version{4, 5}, Version{4, 3}};

bool has_word(const char* list, std::string_view word) {
  std::string_view rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const auto end = rest.find(' ');
    if (rest.substr(0, end) == word) return true;
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  return false;
}

std::string egl_error(const char* call) {
  constexpr const char* kDigits = "0123456789abcdef";
  const auto code = static_cast<unsigned>(eglGetError());
  std::string text = std::string(call) + " fails with EGL error 0x";
  for (int shift = 12; shift >= 0; shift -= 4) text += kDigits[(code >> shift) & 15u];
  return text;
}

// ---- EGL -------------------------------------------------------------------------------------

class EglContext final : public Context {
 public:
  EglContext(EGLDisplay display, const char* platform) : display_(display) {
    if (display_ == EGL_NO_DISPLAY) throw ContextError("there is no such display");
    EGLint major = 0;
    EGLint minor = 0;
    if (eglInitialize(display_, &major, &minor) != EGL_TRUE) {
      throw ContextError(egl_error("eglInitialize"));
    }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) throw ContextError("EGL has no desktop OpenGL");
    const char* extensions = eglQueryString(display_, EGL_EXTENSIONS);
    const EGLint config_attributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                        EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    const bool found = eglChooseConfig(display_, config_attributes, &config, 1, &configs) == EGL_TRUE && configs > 0;
    if (!found) {
      if (!has_word(extensions, "EGL_KHR_no_config_context")) {
        throw ContextError("EGL offers no configuration for OpenGL");
      }
      config = nullptr;  // EGL_NO_CONFIG_KHR
    }
    for (const auto version : kVersions) {
      const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                   version.major,
                                   EGL_CONTEXT_MINOR_VERSION,
                                   version.minor,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                   EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                   EGL_NONE};
      context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes);
      if (context_ != EGL_NO_CONTEXT) break;
    }
    if (context_ == EGL_NO_CONTEXT) {
      throw ContextError("no OpenGL 4.3 core: " + egl_error("eglCreateContext"));
    }
    if (!has_word(extensions, "EGL_KHR_surfaceless_context") && found) {
      const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
      surface_ = eglCreatePbufferSurface(display_, config, size);
    }
    try {
      if (!make_current()) throw ContextError(egl_error("eglMakeCurrent"));
      load(platform, eglGetProcAddress);
      release();
    } catch (...) {
      destroy();
      throw;
    }
  }
  ~EglContext() override { destroy(); }

 private:
  bool make_current() noexcept override {
    // The bound API is a property of the thread.
    return eglBindAPI(EGL_OPENGL_API) == EGL_TRUE && eglMakeCurrent(display_, surface_, surface_, context_) == EGL_TRUE;
  }
  void release() noexcept override { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }
  void destroy() noexcept {
    release();
    if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
    eglDestroyContext(display_, context_);
    // The display is shared by every context of the process and is left initialised.
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface surface_ = EGL_NO_SURFACE;
};

template <typename Function>
Function egl_extension(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

std::unique_ptr<Context> create_egl_device() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto query_devices = egl_extension<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto query_string = egl_extension<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  const auto get_display = egl_extension<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  const bool enumerates = has_word(client, "EGL_EXT_device_base") || has_word(client, "EGL_EXT_device_enumeration");
  if (!enumerates || query_devices == nullptr || get_display == nullptr) {
    throw ContextError("this EGL does not list devices");
  }
  std::array<EGLDeviceEXT, 64> devices{};
  EGLint count = 0;
  if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE || count == 0) {
    throw ContextError("EGL finds no device");
  }
  std::string problems;
  for (const bool software : {false, true}) {
    for (EGLint i = 0; i < count; ++i) {
      const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
      const char* extensions = query_string != nullptr ? query_string(device, EGL_EXTENSIONS) : nullptr;
      if (has_word(extensions, "EGL_MESA_device_software") != software) continue;
      try {
        return std::make_unique<EglContext>(get_display(EGL_PLATFORM_DEVICE_EXT, device, nullptr), "EGL device");
      } catch (const ContextError& error) {
        problems += (problems.empty() ? "" : ", ") + std::string("device ") + std::to_string(i) + ": " + error.what();
      }
    }
  }
  throw ContextError(problems);
}

std::unique_ptr<Context> create_egl_surfaceless() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto get_display = egl_extension<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (!has_word(client, "EGL_MESA_platform_surfaceless") || get_display == nullptr) {
    throw ContextError("this EGL has no surfaceless platform");
  }
  return std::make_unique<EglContext>(get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
                                      "EGL surfaceless");
}

std::unique_ptr<Context> create_egl_default() {
  return std::make_unique<EglContext>(eglGetDisplay(EGL_DEFAULT_DISPLAY), "EGL default display");
}

// ---- OSMesa ----------------------------------------------------------------------------------
// Looked up at run time, so that a machine without it neither builds nor starts any worse. The few
// declarations needed are those of GL/osmesa.h.

struct OsmesaLibrary {
  using OSMesaContext = struct osmesa_context*;
  OSMesaContext (*create)(const int* attributes, OSMesaContext shared) = nullptr;
  void (*destroy)(OSMesaContext) = nullptr;
  GLboolean (*make_current)(OSMesaContext, void* buffer, GLenum type, GLsizei width, GLsizei height) = nullptr;
  GetFunction get_function = nullptr;

  // Stays loaded: drivers do not like to be unloaded.
  static const OsmesaLibrary& get() {
    static const OsmesaLibrary library;
    return library;
  }

 private:
  OsmesaLibrary() {
    const char* path = std::getenv("BODYSCHEMA_OSMESA");
    std::vector<std::string> names{"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};
    if (path != nullptr) names = {path};
    void* handle = nullptr;
    for (const auto& name : names) {
      handle = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
      if (handle != nullptr) break;
    }
    if (handle == nullptr) throw ContextError("cannot load " + names.front());
    const auto find = [&](auto& function, const char* name) {
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(handle, name));
      if (function == nullptr) throw ContextError("OSMesa is too old, it has no " + std::string(name));
    };
    find(create, "OSMesaCreateContextAttribs");
    find(destroy, "OSMesaDestroyContext");
    find(make_current, "OSMesaMakeCurrent");
    find(get_function, "OSMesaGetProcAddress");
  }
};

class OsmesaContext final : public Context {
 public:
  OsmesaContext() : library_(OsmesaLibrary::get()) {
    constexpr int kFormat = 0x22, kProfile = 0x33, kCoreProfile = 0x34, kMajor = 0x36, kMinor = 0x37;
    for (const auto version : kVersions) {
      const int attributes[] = {kFormat, GL_RGBA,       kProfile, kCoreProfile, kMajor, version.major,
                                kMinor,  version.minor, 0};
      context_ = library_.create(attributes, nullptr);
      if (context_ != nullptr) break;
    }
    if (context_ == nullptr) throw ContextError("OSMesa has no OpenGL 4.3 core");
    try {
      if (!make_current()) throw ContextError("OSMesaMakeCurrent fails");
      load("OSMesa", library_.get_function);
      release();
    } catch (...) {
      library_.destroy(context_);
      throw;
    }
  }
  ~OsmesaContext() override {
    release();
    library_.destroy(context_);
  }

 private:
  bool make_current() noexcept override {
    // Everything is drawn into framebuffer objects; OSMesa wants a window all the same.
    return library_.make_current(context_, window_.data(), GL_UNSIGNED_BYTE, 1, 1) == GL_TRUE;
  }
  void release() noexcept override { library_.make_current(nullptr, nullptr, 0, 0, 0); }

  const OsmesaLibrary& library_;
  OsmesaLibrary::OSMesaContext context_ = nullptr;
  std::array<std::uint8_t, 4> window_{};
};

std::unique_ptr<Context> create_osmesa() {
  return std::make_unique<OsmesaContext>();
}

}  // namespace

Context::Context() = default;
Context::~Context() = default;

void Context::load(std::string platform, GetFunction get_function) {
  functions_ = std::make_unique<Functions>();
#define BODYSCHEMA_GL_LOAD(name, type)                                 \
  functions_->name = reinterpret_cast<type>(get_function("gl" #name)); \
  if (functions_->name == nullptr) throw ContextError("the driver has no gl" #name);
  BODYSCHEMA_GL_FUNCTIONS(BODYSCHEMA_GL_LOAD)
#undef BODYSCHEMA_GL_LOAD
  platform_ = std::move(platform);
  const auto* renderer = functions_->GetString(GL_RENDERER);
  renderer_ = renderer != nullptr ? reinterpret_cast<const char*>(renderer) : "unknown";
  functions_->GetIntegerv(GL_MAJOR_VERSION, &major_);
  functions_->GetIntegerv(GL_MINOR_VERSION, &minor_);
  if (major_ < 4 || (major_ == 4 && minor_ < 3)) {
    throw ContextError("OpenGL " + std::to_string(major_) + "." + std::to_string(minor_) + " is less than 4.3");
  }
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SWR", "Software"}) {
    if (renderer_.find(name) != std::string::npos) is_software_ = true;
  }
}

std::string Context::description() const {
  const auto name = renderer_.substr(0, renderer_.find(" ("));
  return name + " (" + platform_ + ", OpenGL " + std::to_string(major_) + "." + std::to_string(minor_) + ")";
}

std::unique_ptr<Context> Context::create(std::string_view platform) {
  struct Way {
    const char* option;
    const char* name;
    std::unique_ptr<Context> (*create)();
  };
  constexpr std::array kWays{Way{"egl_device", "EGL device", create_egl_device},
                             Way{"egl_surfaceless", "EGL surfaceless", create_egl_surfaceless},
                             Way{"", "EGL default display", create_egl_default},
                             Way{"osmesa", "OSMesa", create_osmesa}};
  const auto names_it = [&](const Way& way) { return platform == way.option; };
  if (platform != "auto" && (platform.empty() || std::ranges::none_of(kWays, names_it))) {
    throw std::invalid_argument("OpenGL platform '" + std::string(platform) +
                                "', expected auto, egl_device, egl_surfaceless or osmesa");
  }
  std::string problems;
  for (const auto& way : kWays) {
    if (platform != "auto" && !names_it(way)) continue;
    try {
      return way.create();
    } catch (const ContextError& error) {
      problems += (problems.empty() ? "" : "; ") + std::string(way.name) + ": " + error.what();
    }
  }
  throw ContextError("no headless OpenGL context of version 4.3 or later on this machine (" + problems + ")");
}

}  // namespace bodyschema::gl
