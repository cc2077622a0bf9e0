// Answers for one scene file from an Open Inventor library: Coin, or SGI's own (libinventor).
//   inventor FILE TIME WIDTH HEIGHT PICTURE.ppm TEXT.iv
// The answer is JSON on standard output, the picture a PPM file, the scene as the library writes it TEXT.iv. A width of
// 0 asks for no picture. Exit code 2: the library does not read the file. Build:
//   g++ -O1 -o coin inventor.cpp -lCoin -lEGL -lGL
//   g++ -O1 -fpermissive -w -I SGI/include -o sgi inventor.cpp -lInventor -lEGL -lGL
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoInteraction.h>
#include <Inventor/SoOutput.h>
#include <Inventor/SbViewportRegion.h>
#include <Inventor/SoPrimitiveVertex.h>
#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/actions/SoGLRenderAction.h>
#include <Inventor/actions/SoGetBoundingBoxAction.h>
#include <Inventor/actions/SoGetMatrixAction.h>
#include <Inventor/actions/SoSearchAction.h>
#include <Inventor/actions/SoWriteAction.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/fields/SoSFTime.h>
#include <Inventor/nodekits/SoBaseKit.h>
#include <Inventor/nodekits/SoNodeKit.h>
#include <Inventor/nodes/SoOrthographicCamera.h>
#include <Inventor/nodes/SoPerspectiveCamera.h>
#include <Inventor/nodes/SoSeparator.h>
#include <Inventor/nodes/SoShape.h>
#include <Inventor/nodes/SoWWWInline.h>
#include <Inventor/sensors/SoSensorManager.h>
#ifdef __COIN__
#include <Inventor/VRMLnodes/SoVRMLNavigationInfo.h>
#include <Inventor/VRMLnodes/SoVRMLViewpoint.h>
#include <Inventor/nodes/SoDirectionalLight.h>
#endif
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

static std::vector<std::string> messages;
static int triangles = 0;

static std::string quote(const char *text) {
  std::string out = "\"";
  for (; *text; text++) {
    unsigned char c = *text;
    char code[8];
    if (c == '"' || c == '\\') { out += '\\'; out += c; }
    else if (c < 32 || c > 126) { snprintf(code, 8, "\\u%04x", c); out += code; }
    else out += c;
  }
  return out + "\"";
}

static void onError(const SoError *error, void *) {
  const char *text = error->getDebugString().getString();
  if (std::string(text).find("glxglue") == std::string::npos) messages.push_back(text);
}

static void onTriangle(void *, SoCallbackAction *, const SoPrimitiveVertex *, const SoPrimitiveVertex *,
                       const SoPrimitiveVertex *) {
  triangles++;
}

// Reads the file of a WWWInline, which the libraries leave to the application.
static void fetch(const SbString &url, void *, SoWWWInline *node) {
  SoInput in;
  SoSeparator *read = in.openFile(url.getString()) ? SoDB::readAll(&in) : 0;
  if (read) node->setChildData(read);
  else messages.push_back(url.getString());
}

static void vector(const char *name, SbVec3f v) { printf(", \"%s\": [%.9g, %.9g, %.9g]", name, v[0], v[1], v[2]); }

static SoPath *first(SoNode *root, SoType type) {
  SoSearchAction search;
  search.setType(type);
  search.setInterest(SoSearchAction::FIRST);
  search.apply(root);
  if (search.getPath()) search.getPath()->ref();
  return search.getPath();
}

static SbMatrix matrixOf(SoPath *path, const SbViewportRegion &view) {
  SoGetMatrixAction action(view);
  action.apply(path);
  return action.getMatrix();
}

// Prints a camera in world space. For a Viewpoint of VRML97 it puts a camera, and the headlight, before the scene.
static void camera(SoSeparator *root, SoNode *scene, const SbViewportRegion &view) {
  if (SoPath *path = first(scene, SoCamera::getClassTypeId())) {
    SoCamera *c = (SoCamera *)((SoFullPath *)path)->getTail();
    SbMatrix matrix = matrixOf(path, view);
    SbVec3f position, direction;
    matrix.multVecMatrix(c->position.getValue(), position);
    c->orientation.getValue().multVec(SbVec3f(0, 0, -1), direction);
    matrix.multDirMatrix(direction, direction);
    direction.normalize();
    printf(", \"camera\": {\"type\": %s", quote(c->getTypeId().getName().getString()).c_str());
    vector("position", position);
    vector("direction", direction);
    if (c->isOfType(SoPerspectiveCamera::getClassTypeId()))
      printf(", \"angle\": %.9g", ((SoPerspectiveCamera *)c)->heightAngle.getValue());
    if (c->isOfType(SoOrthographicCamera::getClassTypeId()))
      printf(", \"height\": %.9g", ((SoOrthographicCamera *)c)->height.getValue());
    printf("}");
    return;
  }
#ifdef __COIN__
  if (SoPath *path = first(scene, SoVRMLViewpoint::getClassTypeId())) {
    SoVRMLViewpoint *v = (SoVRMLViewpoint *)((SoFullPath *)path)->getTail();
    SbMatrix matrix = matrixOf(path, view);
    SbVec3f position, direction, t, s;
    SbRotation r, so;
    matrix.multVecMatrix(v->position.getValue(), position);
    matrix.getTransform(t, r, s, so);
    SoPerspectiveCamera *c = new SoPerspectiveCamera;
    c->position = position;
    c->orientation = v->orientation.getValue() * r;
    c->heightAngle = v->fieldOfView.getValue();
    c->nearDistance = 0.1f;
    c->farDistance = 1000;
    root->insertChild(c, 0);
    c->orientation.getValue().multVec(SbVec3f(0, 0, -1), direction);
    printf(", \"camera\": {\"type\": \"Viewpoint\"");
    vector("position", position);
    vector("direction", direction);
    printf(", \"angle\": %.9g}", v->fieldOfView.getValue());
    SoPath *info = first(scene, SoVRMLNavigationInfo::getClassTypeId());
    if (!info || ((SoVRMLNavigationInfo *)((SoFullPath *)info)->getTail())->headlight.getValue()) {
      SoDirectionalLight *headlight = new SoDirectionalLight;
      headlight->direction = direction;
      root->insertChild(headlight, 1);
    }
  }
#endif
}

// Makes an OpenGL context without a display, by the surfaceless platform of Mesa.
static bool context(int width, int height) {
  EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, 0);
  EGLint count = 0;
  EGLConfig config;
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_RED_SIZE, 8,
                           EGL_GREEN_SIZE, 8, EGL_BLUE_SIZE, 8, EGL_DEPTH_SIZE, 24, EGL_NONE};
  const EGLint size[] = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
  if (!display || !eglInitialize(display, 0, 0) || !eglBindAPI(EGL_OPENGL_API)) return false;
  if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) return false;
  EGLContext made = eglCreateContext(display, config, EGL_NO_CONTEXT, 0);
  EGLSurface surface = eglCreatePbufferSurface(display, config, size);
  return made && surface && eglMakeCurrent(display, surface, surface, made);
}

static bool picture(SoNode *root, const SbViewportRegion &view, int width, int height, const char *name) {
  if (!context(width, height)) return false;
  glViewport(0, 0, width, height);
  glEnable(GL_DEPTH_TEST);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  SoGLRenderAction render(view);
  render.setTransparencyType(SoGLRenderAction::SORTED_OBJECT_BLEND);
  render.apply(root);
  glFinish();
  std::vector<unsigned char> pixels(3 * width * height);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  FILE *out = fopen(name, "wb");
  if (!out) return false;
  fprintf(out, "P6 %d %d 255\n", width, height);
  for (int y = height - 1; y >= 0; y--) fwrite(&pixels[3 * width * y], 3, width, out);
  return fclose(out) == 0;
}

static void setTime(double seconds) {
  ((SoSFTime *)SoDB::getGlobalField("realTime"))->setValue(SbTime(seconds));
  for (int i = 0; i < 5; i++) SoDB::getSensorManager()->processDelayQueue(TRUE);
}

// Returns whether `SoDB::readAll` puts the nodes of a file into a Separator of its own.
static bool wrapped(const char *name) {
  SoInput in;
  SoNode *node = 0, *only = 0;
  int roots = 0;
  if (!in.openFile(name)) return false;
  while (SoDB::read(&in, node) && node) { node->ref(); only = node; roots++; }
  return roots != 1 || !only->isOfType(SoSeparator::getClassTypeId());
}

int main(int count, char **words) {
  if (count < 7) return fprintf(stderr, "inventor FILE TIME WIDTH HEIGHT PICTURE.ppm TEXT.iv\n"), 1;
  int width = atoi(words[3]), height = atoi(words[4]);
  SoDB::init();
  SoNodeKit::init();
  SoInteraction::init();
  SoBaseKit::setSearchingChildren(TRUE);
  SoReadError::setHandlerCallback(onError, 0);
  SoDebugError::setHandlerCallback(onError, 0);
  SoWWWInline::setFetchURLCallBack(fetch, 0);
  SoDB::setRealTimeInterval(SbTime::zero());
  SbViewportRegion view((short)(width ? width : 100), (short)(height ? height : 100));
  setTime(0);
  std::string file = words[1];
  SoInput::addDirectoryFirst(file.find('/') == std::string::npos ? "." : file.substr(0, file.rfind('/')).c_str());
  bool inside = wrapped(words[1]);
  messages.clear();
  SoInput in;
  SoSeparator *scene = in.openFile(words[1]) ? SoDB::readAll(&in) : 0;
  printf("{\"read\": %s, \"wrapped\": %s", scene ? "true" : "false", inside ? "true" : "false");
  if (scene) {
    scene->ref();
    setTime(atof(words[2]));
    size_t said = messages.size();
    SoWriteAction write;
    if (write.getOutput()->openFile(words[6])) write.apply(scene);
    write.getOutput()->closeFile();
    messages.resize(said);  // those of writing do not count
    SoSeparator *root = new SoSeparator;
    root->ref();
    root->addChild(scene);
    camera(root, scene, view);
    SoGetBoundingBoxAction bounds(view);
    bounds.apply(scene);
    SbBox3f box = bounds.getBoundingBox();
    if (!box.isEmpty()) {
      printf(", \"box\": {\"a\": 0");
      vector("min", box.getMin());
      vector("max", box.getMax());
      printf("}");
    }
    SoCallbackAction action;
    action.addTriangleCallback(SoShape::getClassTypeId(), onTriangle, 0);
    action.apply(root);
    printf(", \"triangles\": %d", triangles);
    if (width) printf(", \"picture\": %s", picture(root, view, width, height, words[5]) ? "true" : "false");
  }
  printf(", \"messages\": [");
  for (size_t i = 0; i < messages.size(); i++) printf("%s%s", i ? ", " : "", quote(messages[i].c_str()).c_str());
  printf("]}\n");
  fflush(stdout);
  _Exit(scene ? 0 : 2);
}
