# raycam as a command: docker run --rm -v "$PWD":/data raycam render model.glb
# Limits of memory and cores that the container has are those that raycam keeps to.
FROM python:3.13-slim

ARG VERSION=
# A wheel in dist/ is taken if there is one, else the newest release.
COPY dist* /dist/
RUN pip install --no-cache-dir --find-links /dist "raycam[video,denoise,usd]${VERSION:+==$VERSION}" \
    && rm -rf /dist \
    && useradd --uid 1000 --create-home raycam
USER 1000
WORKDIR /data
ENTRYPOINT ["raycam"]
CMD ["--help"]
