MODULE InlineTargets
  PROC main()
    MoveL [[600,-12.5,800.25],[0.7071068,0,0.7071068,0],[-1,0,-2,0],[9E+09,115.501,9E9,9E9,9E9,9E9]],v100,z10,tGun\WObj:=wPart;
    MoveL Offs([[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,-50),vmax,fine,tGun;
    MoveJ RelTool(p10,3,-1.1,1\Rz:=31),v50,z1,tGun;
    MoveAbsJ [[0,-20,10.5,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\NoEOffs,v500,z50,tool0;
    ArcLStart [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,seam13,weld13,fine,tWeldGun;
    SpotL [[-1366.65,1108.96,920.06],[0.0044,-0.7,0.7,0.1],[1,0,-2,0],[9E+09,115.5,9E+09,9E+09,9E+09,9E+09]],vmax,gun1,sd_7614,tGun;
    MoveL_CollReq 5,12,[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tGun;
  ENDPROC
ENDMODULE
