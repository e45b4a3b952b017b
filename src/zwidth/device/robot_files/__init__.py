"""Device files from robot files: MJCF and URDF.

import_file   `import_file(path, handle=...)`: the whole way
robot         what a robot file holds
decide        what it leaves open
"""
